#include "tools/relmap/map_drawing.h"

#include <algorithm>
#include <cmath>

#include "client/path_uncertainty.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

namespace {

client::MapPicture::EdgeKind picture_kind(const client::Edge& edge) {
  if (edge.kind != client::EdgeKind::kLoop) {
    if (!edge.carried_by.empty()) return client::MapPicture::EdgeKind::kCarriedMotion;
    return edge.unmeasured ? client::MapPicture::EdgeKind::kUnmeasuredMotion : client::MapPicture::EdgeKind::kMotion;
  }
  switch (edge.state) {
    case client::EdgeState::kCandidate:
      return client::MapPicture::EdgeKind::kLoopCandidate;
    case client::EdgeState::kQuarantined:
      return client::MapPicture::EdgeKind::kLoopQuarantined;
    case client::EdgeState::kRemoved:
      return client::MapPicture::EdgeKind::kLoopRemoved;
    case client::EdgeState::kAccepted:
      break;
  }
  return client::MapPicture::EdgeKind::kLoopAccepted;
}

}  // namespace

client::MapPicture picture_of(const RelaxedMap& map, bool removed) {
  client::MapPicture picture;
  picture.session_names = map.graph.names;
  for (const MapPart& part : map.parts) {
    client::MapPicture::Part& drawn = picture.parts.emplace_back();
    drawn.root = part.root;
    for (const PlacedFrame& placed : part.frames) drawn.frames.push_back({placed.frame, placed.T_root_frame});
    for (const MapPart::Label& label : part.labels) picture.labels.push_back({label.frame, label.text});
  }
  std::size_t loops = 0;
  for (const client::Edge& edge : map.graph.edges) {
    if (edge.state == client::EdgeState::kRemoved && !removed) continue;
    picture.edges.push_back({edge.a, edge.b, picture_kind(edge)});
    if (edge.kind == client::EdgeKind::kLoop && edge.state == client::EdgeState::kAccepted) ++loops;
  }
  const std::size_t sessions = map.graph.names.size(), frames = map.graph.frames.size();
  picture.subtitle = counted_text(sessions, "session") + ", " + counted_text(frames, "keyframe") + ", " +
                     counted_text(loops, "loop closure");
  picture.mono_sessions = map.graph.mono_sessions;
  return picture;
}

void mark_tears(const RelaxedMap& map, client::MapPicture& picture) {
  for (const MapPart& part : map.parts)
    for (const Tear& tear : part.tears) picture.tears.push_back({tear.a, tear.b, tear.sigmas});
  std::stable_sort(picture.tears.begin(), picture.tears.end(),
                   [](const auto& x, const auto& y) { return x.sigmas > y.sigmas; });
  for (const Tear& strain : map.strained)
    picture.strained.push_back(strain.edge.to_string() + ": " + fixed(strain.sigmas, 1) + " sigmas, " +
                               fixed(strain.metres, 2) + " m");
}

void colour_by_time(const RelaxedMap& map, client::MapPicture& picture) {
  const auto times = frame_times(map.graph);
  std::int64_t first = 0, last = 0;
  bool any = false;
  for (const auto& [frame, time] : times) {
    first = any ? std::min(first, time) : time;
    last = any ? std::max(last, time) : time;
    any = true;
  }
  picture.scale = {"colour: when it was driven", any ? time_text(first) : "", any ? time_text(last) : ""};
  for (client::MapPicture::Part& part : picture.parts)
    for (client::MapPicture::Frame& frame : part.frames)
      if (const auto found = times.find(frame.id); found != times.end())
        frame.value = last > first ? static_cast<double>(found->second - first) / static_cast<double>(last - first) : 0;
}

void colour_by_uncertainty(const RelaxedMap& map, client::MapPicture& picture) {
  std::vector<std::vector<double>> sigmas;
  double highest = 0;
  for (const MapPart& part : map.parts) {
    sigmas.push_back(uncertainty_of(map, part));
    for (const double sigma : sigmas.back())
      if (std::isfinite(sigma)) highest = std::max(highest, sigma);
  }
  picture.scale = {"colour: uncertainty of the position relative to " +
                       (map.parts.size() == 1 ? map.parts[0].root.to_string() : std::string("the root of each part")),
                   "0 m", number_text(highest) + " m (one sigma)"};
  for (std::size_t p = 0; p < picture.parts.size(); ++p)
    for (std::size_t f = 0; f < picture.parts[p].frames.size(); ++f)
      picture.parts[p].frames[f].value = highest > 0 ? sigmas[p][f] / highest : sigmas[p][f];
}

std::unordered_map<FrameId, std::int64_t> frame_times(const MapGraph& graph) {
  std::unordered_map<FrameId, std::int64_t> times;
  for (const client::Edge& edge : graph.edges)
    if (edge.time_us != 0) times[edge.b] = edge.time_us;
  for (const FrameId frame : graph.frames) {
    const auto found = graph.sessions_by_number.find(frame.session);
    if (found == graph.sessions_by_number.end() || times.contains(frame)) continue;
    const client::Session& session = found->second;
    const double share = session.last > session.first ? static_cast<double>(frame.index - session.first) /
                                                            static_cast<double>(session.last - session.first)
                                                      : 0;
    times[frame] =
        session.first_time_us + std::llround(share * static_cast<double>(session.last_time_us - session.first_time_us));
  }
  return times;
}

std::vector<double> uncertainty_of(const RelaxedMap& map, const MapPart& part) {
  std::vector<FrameId> frames;
  for (const PlacedFrame& placed : part.frames) frames.push_back(placed.frame);
  std::vector<client::RelaxationEdge> edges;
  for (const std::size_t spring : part.edges)
    if (map.springs[spring].pulls) edges.push_back(map.springs[spring].relaxed);
  return client::position_sigmas(frames, edges, part.root);
}

}  // namespace relmap::cli
