#include "tools/console/layout/local_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "client/relaxation.h"
#include "client/springs.h"
#include "client/tear.h"
#include "tools/console/layout/layout_placement.h"

namespace relmap::console {
namespace {

constexpr std::uint32_t kAnyDepth = 1'000'000;
constexpr double kMostMetres = 10'000;

bool is_closure(const client::Edge& edge) { return edge.id.ordinal > 0; }
Vector2 from_above(const SE3& T_root_frame) { return {T_root_frame.t.x(), T_root_frame.t.z()}; }
double heading_from_above(const SE3& T_root_frame) { return std::atan2(T_root_frame.R(2, 2), T_root_frame.R(0, 2)); }

// The edge as it was measured: refinement has shared out over the edges around a closure what it contradicts.
client::Edge as_measured(client::Edge edge, const std::set<EdgeId>& gone) {
  std::erase_if(edge.carried_by, [&](EdgeId closure) { return gone.contains(closure); });
  if (!edge.measured) return edge;
  edge.T_ab = edge.measured->T_ab;
  edge.covariance = edge.measured->covariance;
  return edge;
}

struct Poses {
  std::vector<SE3> T_root_frame;  // by frame; of a part that is not joined with the root in its own coordinates
  std::vector<bool> with_root;
  bool converged = true;
};

// `frames`: ascending. `root`: one of them.
Result<Poses> relaxed(const std::vector<FrameId>& frames, FrameId root, const std::vector<client::Edge>& edges) {
  std::vector<client::RelaxationEdge> pulling;
  for (const client::Spring& spring : client::springs_of(edges))
    if (spring.pulls) pulling.push_back(spring.relaxed);
  client::RelaxationOptions options;
  options.max_iterations = 20;
  options.relative_tolerance = 1e-4;
  const auto found = client::relax(frames, pulling, options);
  if (!found.ok()) return found.status();
  const auto at = static_cast<std::size_t>(std::lower_bound(frames.begin(), frames.end(), root) - frames.begin());
  const client::RelaxedPose& of_root = found->poses[at];
  const SE3 T_root_component = of_root.T_component_frame.inverse();
  Poses poses;
  poses.converged = found->converged;
  for (const client::RelaxedPose& pose : found->poses) {
    const bool joined = pose.component == of_root.component;
    poses.with_root.push_back(joined);
    poses.T_root_frame.push_back(joined ? T_root_component * pose.T_component_frame : pose.T_component_frame);
  }
  return poses;
}

// Puts what is not joined with the root where the other layout has it.
LocalLayout::Laid laid(const Poses& poses, const Poses& other, std::size_t newer_end) {
  LocalLayout::Laid out;
  out.converged = poses.converged;
  out.joined = poses.with_root[newer_end];
  PlaneFit fit;
  for (std::size_t k = 0; k < poses.T_root_frame.size(); ++k)
    if (!poses.with_root[k] && other.with_root[k])
      fit.add(from_above(poses.T_root_frame[k]), from_above(other.T_root_frame[k]),
              heading_from_above(poses.T_root_frame[k]), heading_from_above(other.T_root_frame[k]));
  const PlaneMotion motion = fit.motion();
  for (std::size_t k = 0; k < poses.T_root_frame.size(); ++k) {
    const Vector2 at = from_above(poses.T_root_frame[k]);
    out.at.push_back(poses.with_root[k] ? at : motion(at));
  }
  return out;
}

// The closures that the daemon would remove with this one, itself left out.
std::vector<EdgeId> removed_with(EdgeId edge, client::Client& client) {
  const auto edit = client.edit_edge(edge, client::EdgeAction::kRemove, {.dry_run = true});
  std::vector<EdgeId> gone;
  if (!edit.ok()) return gone;
  for (const client::ClosureChange& change : edit->effect.closures)
    if (change.edge_before && !change.edge_after && change.id != edge) gone.push_back(change.id);
  return gone;
}

nlohmann::ordered_json laid_json(const LocalLayout& layout, const LocalLayout::Laid& laid,
                                 const std::vector<std::string>& names) {
  std::vector<double> x, y;
  for (const Vector2& at : laid.at) {
    x.push_back(std::round(1000 * at.x()) / 1000);
    y.push_back(std::round(1000 * at.y()) / 1000);
  }
  return {{"frames", names},     {"x", std::move(x)},     {"y", std::move(y)},
          {"runs", layout.runs}, {"joined", laid.joined}, {"converged", laid.converged}};
}

}  // namespace

Result<LocalLayout> lay_out_locally(const client::Edge& closure, std::vector<client::Edge> edges,
                                    std::vector<FrameId> frames, const std::vector<EdgeId>& goes_with) {
  frames.push_back(closure.a);
  frames.push_back(closure.b);
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  const auto position = [&](FrameId frame) {
    return static_cast<std::uint32_t>(std::lower_bound(frames.begin(), frames.end(), frame) - frames.begin());
  };
  const auto known = [&](FrameId frame) { return std::binary_search(frames.begin(), frames.end(), frame); };
  std::erase_if(edges,
                [&](const client::Edge& edge) { return edge.id == closure.id || !known(edge.a) || !known(edge.b); });
  edges.push_back(closure);
  std::sort(edges.begin(), edges.end(), [](const auto& x, const auto& y) { return x.id < y.id; });
  edges.erase(std::unique(edges.begin(), edges.end(), [](const auto& x, const auto& y) { return x.id == y.id; }),
              edges.end());
  std::set<EdgeId> gone(goes_with.begin(), goes_with.end());
  gone.insert(closure.id);

  LocalLayout out;
  out.edge = closure.id;
  out.root = closure.a;
  const bool refined = client::in_graph(closure);  // and the edges around it with it
  std::vector<client::Edge> rest;
  for (client::Edge& edge : edges) {
    if (is_closure(edge))
      out.closures.push_back({edge.id, position(edge.a), position(edge.b), client::in_graph(edge),
                              gone.contains(edge.id), edge.suspicion ? edge.suspicion->value : 0});
    if (!is_closure(edge) || !gone.contains(edge.id)) rest.push_back(refined ? as_measured(edge, gone) : edge);
    if (edge.id != closure.id) continue;
    edge.state = client::EdgeState::kAccepted;  // as it would be in force
    edge.carries = true;
  }
  const auto with = relaxed(frames, out.root, edges);
  if (!with.ok()) return with.status();
  const auto without = relaxed(frames, out.root, rest);
  if (!without.ok()) return without.status();
  const std::size_t a = position(closure.a), b = position(closure.b);
  client::Edge supposed = as_measured(closure, gone);
  supposed.state = client::EdgeState::kAccepted;
  supposed.carries = true;
  const client::Spring spring = client::springs_of(std::vector{supposed}).front();
  out.sigmas = client::strain_of(spring, with->T_root_frame[a], with->T_root_frame[b]).sigmas;
  if (without->with_root[b]) {
    const client::Tear off = client::strain_of(spring, without->T_root_frame[a], without->T_root_frame[b]);
    out.metres = off.metres;
    out.degrees = off.degrees;
  }
  out.with = laid(*with, *without, b);
  out.without = laid(*without, *with, b);
  for (std::uint32_t k = 0; k < frames.size(); ++k)
    if (k == 0 || frames[k].session != frames[k - 1].session || frames[k].index != frames[k - 1].index + 1)
      out.runs.push_back(k);
  out.frames = std::move(frames);
  return out;
}

Result<LocalLayout> local_layout(const LocalRequest& request, client::Client& client) {
  const EdgeId id = request.edge;
  if (!std::isfinite(request.metres) || request.metres <= 0 || request.metres > kMostMetres)
    return {Reason::INVALID_ARGUMENT, "metres must be more than 0 and at most 10000"};
  if (id.ordinal == 0)
    return {Reason::ODOMETRY_EDGE, id.to_string() + " is the robot's own motion; only a loop closure can be left out"};
  const auto frame = client.frame(id.frame);
  if (!frame.ok()) return frame.status();
  const auto found =
      std::find_if(frame->edges.begin(), frame->edges.end(), [&](const client::Edge& edge) { return edge.id == id; });
  if (found == frame->edges.end()) return {Reason::NO_SUCH_EDGE, "there is no closure " + id.to_string()};
  std::vector<client::Edge> edges;
  std::vector<FrameId> frames;
  bool cut = false;
  for (const FrameId end : {found->a, found->b}) {
    auto around = client.neighbourhood({end, kAnyDepth, request.metres}, kMaxLocalFrames / 2);
    if (!around.ok()) return around.status();
    cut = cut || around->cut;
    for (const auto& member : around->frames) frames.push_back(member.frame);
    std::move(around->edges.begin(), around->edges.end(), std::back_inserter(edges));
  }
  std::vector<EdgeId> goes_with;
  if (request.goes_with)
    goes_with = *request.goes_with;
  else if (client::in_graph(*found))
    goes_with = removed_with(id, client);
  auto layout = lay_out_locally(*found, std::move(edges), std::move(frames), goes_with);
  if (layout.ok()) layout->cut = cut;
  return layout;
}

std::string json_of(const LocalLayout& layout) {
  using Document = nlohmann::ordered_json;
  std::vector<std::string> names;
  for (const FrameId frame : layout.frames) names.push_back(frame.to_string());
  Document closures = Document::array();
  for (const LocalLayout::Closure& closure : layout.closures)
    closures.push_back({{"edge", closure.id.to_string()},
                        {"a", closure.a},
                        {"b", closure.b},
                        {"in_force", closure.in_force},
                        {"goes", closure.goes},
                        {"suspicion", closure.suspicion}});
  const Document document = {{"edge", layout.edge.to_string()},
                             {"root", layout.root.to_string()},
                             {"cut", layout.cut},
                             {"sigmas", layout.sigmas},
                             {"off", {{"metres", layout.metres}, {"degrees", layout.degrees}}},
                             {"with", laid_json(layout, layout.with, names)},
                             {"without", laid_json(layout, layout.without, names)},
                             {"closures", std::move(closures)}};
  return document.dump();
}

}  // namespace relmap::console
