// Records which edges an edit changes while it is made, on the map or on a draft (storage/map/draft.h). So a dry run
// reports exactly what the edit would do to the map.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/route/stretches.h"
#include "storage/graph/editable_graph.h"
#include "storage/graph/forwarding_graph.h"

namespace relmap::map {

// The part of an edge that EdgeChange compares.
struct EdgeStanding {
  storage::EdgeState state = storage::EdgeState::kAccepted;
  Reason reason = Reason::MOTION;
  bool in_graph = false;           // false: a closure that at most binds
  std::vector<EdgeId> carried_by;  // of an odometry edge

  explicit EdgeStanding(const storage::Edge& edge)
      : state(edge.state), reason(edge.reason), in_graph(edge.in_graph()), carried_by(edge.carried_by) {}
  bool operator==(const EdgeStanding&) const = default;
};

struct EdgeChange {
  EdgeId id;
  FrameId a, b;
  storage::EdgeKind kind = storage::EdgeKind::kLoop;
  std::uint32_t bound = 0;                    // observations and landmarks that it justifies while it is in force
  std::uint32_t bound_frames = 0;             // number of frames that these are in
  std::optional<EdgeStanding> before, after;  // nullopt: the edge was, or is, not there

  bool operator==(const EdgeChange&) const = default;
};

// The combined changes of two successive edits, ascending by id: from before the first to after the second.
std::vector<EdgeChange> combined(std::vector<EdgeChange> first, const std::vector<EdgeChange>& second);

// The closures that an edit of `edited` brings into another state without naming them, in the order of `changes`.
// Closures that come or go are not among them.
std::vector<EdgeId> also_changed(const std::vector<EdgeChange>& changes, EdgeId edited);

// Where robots count as carried after an edit and did not before, and the reverse. An edge of which only the closures
// that show it differ is in neither.
struct CarryingChanges {
  route::CarriedStretches carried, not_carried;
};
CarryingChanges carrying_changes(const std::vector<EdgeChange>& changes);

// Passes every edit on to another graph and records the edges before it.
class EdgeRecorder final : public storage::ForwardingGraph<storage::EditableGraph> {
 public:
  // Make the recorder before the first edit since the graph was published or drafted: edit_hot() then copies a frame
  // before it changes. Edit the graph through the recorder only.
  explicit EdgeRecorder(storage::EditableGraph& graph) : ForwardingGraph(graph), graph_(graph) {}

  // The edges that differ in EdgeStanding from when the recorder was made, ascending by id.
  std::vector<EdgeChange> changes() const;

  storage::FrameHot& edit_hot(FrameId id) override;
  storage::FrameWarm& edit_warm(FrameId id) override { return graph_.edit_warm(id); }
  storage::MapState& state() override { return graph_.state(); }

 private:
  storage::EditableGraph& graph_;
  std::map<FrameId, std::shared_ptr<const storage::FrameHot>> before_;  // frames that were edited
};

}  // namespace relmap::map
