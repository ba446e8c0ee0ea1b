// What an edit changes of the edges of the map, or would change: noted while it is made, whoever makes it and however,
// so that what a dry run tells of a draft (storage/map/draft.h) is what the edit does to the map.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "storage/graph/editable_graph.h"
#include "storage/graph/forwarding_graph.h"

namespace relmap::map {

// How an edge stands.
struct EdgeStanding {
  storage::EdgeState state = storage::EdgeState::kAccepted;
  Reason reason = Reason::MOTION;
  bool in_graph = false;           // else it binds at most
  std::vector<EdgeId> carried_by;  // of an edge of the robot's own motion

  explicit EdgeStanding(const storage::Edge& edge)
      : state(edge.state), reason(edge.reason), in_graph(edge.in_graph()), carried_by(edge.carried_by) {}
  bool operator==(const EdgeStanding&) const = default;
};

struct EdgeChange {
  EdgeId id;
  FrameId a, b;
  storage::EdgeKind kind = storage::EdgeKind::kLoop;
  std::uint32_t bound = 0;                    // observations and landmarks that it justifies while it is in force
  std::uint32_t bound_frames = 0;             // in which they are
  std::optional<EdgeStanding> before, after;  // none: it was, or is, not there

  bool operator==(const EdgeChange&) const = default;
};

// Passes every edit on to another graph.
class EdgeRecorder final : public storage::ForwardingGraph<storage::EditableGraph> {
 public:
  // What the graph gives now stays unchanged until it is edited.
  explicit EdgeRecorder(storage::EditableGraph& graph) : ForwardingGraph(graph), graph_(graph) {}

  // Edges that stand otherwise than when the recorder was made, ascending by id.
  std::vector<EdgeChange> changes() const;

  storage::FrameHot& edit_hot(FrameId id) override;
  storage::FrameWarm& edit_warm(FrameId id) override { return graph_.edit_warm(id); }
  storage::MapState& state() override { return graph_.state(); }

 private:
  storage::EditableGraph& graph_;
  std::map<FrameId, std::shared_ptr<const storage::FrameHot>> before_;  // frames that were edited
};

}  // namespace relmap::map
