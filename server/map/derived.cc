#include "server/map/derived.h"

#include <algorithm>
#include <map>
#include <set>

#include "storage/graph/local_graph.h"
#include "storage/graph/observers.h"

namespace relmap::map {

namespace {

std::vector<FrameId> all_frames(const storage::Graph& graph) {
  std::vector<FrameId> frames;
  for (const storage::Session& session : graph.sessions()) {
    if (session.frames == 0) continue;
    for (std::uint64_t index = session.first; index <= session.last; ++index)  // not along `incoming`, which is checked
      if (const FrameId id{session.number, static_cast<std::uint32_t>(index)}; graph.hot(id)) frames.push_back(id);
  }
  return frames;
}

struct Expected {
  std::map<LandmarkId, std::vector<FrameId>> observers;
  std::map<FrameId, std::vector<storage::Unreached>> unreached;
  std::map<FrameId, std::set<EdgeId>> incoming;
  std::map<EdgeId, std::uint32_t> support;
  std::map<EdgeId, std::vector<EdgeId>> carried_by;
};

Expected derive(const storage::Graph& graph, const std::vector<FrameId>& frames) {
  Expected expected;
  storage::LocalGraph local(graph);
  std::vector<storage::LocalStep> path;
  for (const FrameId frame : frames) {
    const auto hot = graph.hot(frame);
    for (const storage::Edge& edge : hot->edges) {
      expected.incoming[edge.a].insert(edge.id);
      storage::for_each_carried_step(edge, [&](EdgeId step) { expected.carried_by[step].push_back(edge.id); });
    }
    std::vector<LandmarkId> not_needed;
    for (const LandmarkId landmark : storage::landmarks_seen(graph, *graph.warm(frame), &not_needed)) {
      if (!local.path(local.frame(landmark.base), local.frame(frame), &path)) {
        expected.unreached[landmark.base].push_back({landmark.slot, frame});
        continue;
      }
      for (const storage::LocalStep& step : path)
        ++expected.support[local.edges[static_cast<std::size_t>(step.edge)].id];
      expected.observers[landmark].push_back(frame);
    }
    for (const LandmarkId landmark : not_needed) expected.unreached[landmark.base].push_back({landmark.slot, frame});
  }
  for (auto& [base, unreached] : expected.unreached) std::sort(unreached.begin(), unreached.end());
  for (auto& [landmark, observers] : expected.observers) storage::keep_first_observers(graph, &observers);
  return expected;
}

}  // namespace

std::vector<std::string> derived_differences(const storage::Graph& graph) {
  const std::vector<FrameId> frames = all_frames(graph);
  Expected expected = derive(graph, frames);
  std::vector<std::string> differences;
  for (const FrameId frame : frames) {
    const auto hot = graph.hot(frame);
    const auto& incoming = expected.incoming[frame];
    if (!std::equal(hot->incoming.begin(), hot->incoming.end(), incoming.begin(), incoming.end()))
      differences.push_back("incoming edges of frame " + frame.to_string());
    if (hot->unreached != expected.unreached[frame])
      differences.push_back("unreached observers of frame " + frame.to_string());
    for (std::uint32_t slot = 0; slot < hot->landmarks.size(); ++slot) {
      if (hot->landmarks[slot].observers != expected.observers[{frame, slot}])
        differences.push_back("observers of landmark " + LandmarkId{frame, slot}.to_string());
    }
    for (const storage::Edge& edge : hot->edges) {
      const std::uint32_t support = expected.support[edge.id];
      const bool prior = edge.kind == storage::EdgeKind::kPrior || support < storage::kMinSupport;
      if (edge.support != support)
        differences.push_back("support of edge " + edge.id.to_string() + ": " + std::to_string(edge.support) +
                              " stored, " + std::to_string(support) + " counted");
      if (auto& carriers = expected.carried_by[edge.id]; edge.carried_by != carriers)
        differences.push_back("carriers of edge " + edge.id.to_string());
      if (edge.in_graph() && edge.prior_active != prior)
        differences.push_back("prior of edge " + edge.id.to_string() + " with support " + std::to_string(support));
    }
  }
  return differences;
}

}  // namespace relmap::map
