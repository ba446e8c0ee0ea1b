#include "tools/relmap/relaxed_map.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "proto/keyframe/motion_source_name.h"

namespace relmap::cli {

namespace {

// One part for each component of the relaxation, with frames and root only.
std::vector<MapPart> parts_of(const client::Relaxation& relaxation, std::optional<FrameId> root) {
  std::vector<MapPart> parts(static_cast<std::size_t>(relaxation.components));
  for (const client::RelaxedPose& pose : relaxation.poses) {
    MapPart& part = parts[static_cast<std::size_t>(pose.component)];
    if (!part.root.valid() || pose.frame == root) part.root = pose.frame;
    part.frames.push_back({pose.frame, pose.T_component_frame});
  }
  for (MapPart& part : parts) {
    const SE3 T_root_component = part.find(part.root)->inverse();
    for (PlacedFrame& placed : part.frames) placed.T_root_frame = (T_root_component * placed.T_root_frame).normalized();
  }
  std::stable_sort(parts.begin(), parts.end(), [&](const MapPart& x, const MapPart& y) {
    if (root && (x.root == root) != (y.root == root)) return x.root == root;
    return x.frames.size() > y.frames.size();
  });
  return parts;
}

}  // namespace

const char* name_of(DoubtfulStep::Beside beside) {
  static constexpr const char* kNames[] = {"unknown", "nothing", "measured", "not joined"};
  return kNames[static_cast<int>(beside)];
}

DoubtfulStep doubtful_step(const client::Edge& edge) {
  DoubtfulStep step;
  step.edge = edge.id;
  step.a = edge.a;
  step.b = edge.b;
  step.carried_by = edge.carried_by;
  step.guess = edge.reason == Reason::DECLARED_GAP ? "gap" : name_of(edge.source);
  step.sigma_m = std::sqrt(edge.covariance.topLeftCorner<3, 3>().trace() / 3);
  return step;
}

std::string DoubtfulStep::words() const {
  std::string text = a.to_string() + " to " + b.to_string() + ": ";
  if (carried_by.empty()) {
    text += guess + ", sigma " + fixed(sigma_m, 2) + " m";
  } else {
    text += "according to closure " + carried_by.front().to_string();
    if (carried_by.size() > 1) text += " and " + std::to_string(carried_by.size() - 1) + " more";
  }
  switch (beside) {
    case Beside::kUnknown:
      break;
    case Beside::kNothing:
      text += "; no measured edges connect its ends";
      break;
    case Beside::kMeasured:
      text += "; measured edges also connect its ends";
      break;
    case Beside::kNotJoined:
      text += "; its ends are in different parts";
      break;
  }
  return text;
}

const SE3* MapPart::find(FrameId frame) const {
  const auto found = std::lower_bound(frames.begin(), frames.end(), frame,
                                      [](const PlacedFrame& placed, FrameId id) { return placed.frame < id; });
  return found == frames.end() || found->frame != frame ? nullptr : &found->T_root_frame;
}

std::vector<SessionNumber> MapPart::sessions() const {
  std::vector<SessionNumber> numbers;
  for (const PlacedFrame& placed : frames)
    if (numbers.empty() || numbers.back() != placed.frame.session) numbers.push_back(placed.frame.session);
  return numbers;
}

Result<RelaxedMap> relax_map(MapGraph graph, const std::vector<client::LabelledFrames>& labels,
                             std::optional<FrameId> root) {
  if (graph.frames.empty()) return {Reason::EMPTY_MAP, "the graph has no frames"};
  if (root && !graph.frames.contains(*root))
    return {Reason::NO_SUCH_FRAME, "frame " + root->to_string() + " is not in the chosen sessions"};
  RelaxedMap map;
  map.graph = std::move(graph);
  map.springs = client::springs_of(map.graph.edges);
  std::vector<client::RelaxationEdge> edges;
  edges.reserve(map.springs.size());
  client::MeasuredSets measured = client::choose_pulling(map.springs);
  for (const client::Spring& spring : map.springs)
    if (spring.pulls) edges.push_back(spring.relaxed);
  const auto relaxed = client::relax({map.graph.frames.begin(), map.graph.frames.end()}, edges);
  if (!relaxed.ok()) return relaxed.status();
  map.parts = parts_of(*relaxed, root);
  map.converged = relaxed->converged;

  std::unordered_map<FrameId, MapPart*> part_of;
  for (MapPart& part : map.parts)
    for (const PlacedFrame& placed : part.frames) part_of[placed.frame] = &part;
  for (std::size_t i = 0; i < map.springs.size(); ++i) part_of.at(map.springs[i].relaxed.a)->edges.push_back(i);
  for (const client::Spring& spring : map.springs) {
    if (spring.doubtful) continue;
    MapPart& part = *part_of.at(spring.relaxed.a);
    const client::Tear strain = client::strain_of(spring, *part.find(spring.relaxed.a), *part.find(spring.relaxed.b));
    if (strain.sigmas > client::kTearSigmas) part.tears.push_back(strain);
  }
  for (const client::Edge& edge : map.graph.edges) {
    if (!client::in_graph(edge) || !client::is_doubtful(edge)) continue;
    DoubtfulStep step = doubtful_step(edge);
    MapPart* const part = part_of.at(edge.a);
    MapPart* const other = part_of.at(edge.b);
    step.beside = part != other                   ? DoubtfulStep::Beside::kNotJoined
                  : measured.join(edge.a, edge.b) ? DoubtfulStep::Beside::kMeasured
                                                  : DoubtfulStep::Beside::kNothing;
    part->doubtful.push_back(step);
    if (part != other) other->doubtful.push_back(step);
  }
  for (MapPart& part : map.parts) client::sort_worst_first(part.tears);
  for (const client::LabelledFrames& label : labels)
    for (const FrameId frame : label.frames)
      if (const auto part = part_of.find(frame); part != part_of.end())
        part->second->labels.push_back({frame, label.label});
  return map;
}

}  // namespace relmap::cli
