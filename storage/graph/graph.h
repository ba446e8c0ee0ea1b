// The relative graph as an algorithm sees it: frames by id, whatever is in memory or on disk.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/graph/chunk.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

// Reads throw StatusError (IO_ERROR, DATA_LOSS, VIEW_EXPIRED, BUDGET_EXCEEDED). A part returned stays valid and
// unchanged for as long as it is held, whatever happens to the map.
class Graph {
 public:
  virtual ~Graph() = default;

  // Null: there is no such frame.
  virtual std::shared_ptr<const FrameHot> hot(FrameId id) const = 0;
  // Of all frames of a chunk; cheaper than one by one.
  virtual Slots<FrameHot> hot_frames(ChunkId chunk) const;
  virtual std::shared_ptr<const FrameWarm> warm(FrameId id) const = 0;
  virtual std::shared_ptr<const FrameCold> cold(FrameId id) const = 0;

  // Sessions, ascending by number.
  virtual std::vector<Session> sessions() const = 0;
  virtual std::optional<Session> session(SessionNumber number) const = 0;
  // What was settled without a frame in a session, from `sequence` on, ascending, until `visit` returns false.
  using SettledVisit = std::function<bool(const Settled&)>;
  virtual void visit_settled(SessionNumber session, std::uint32_t sequence, const SettledVisit& visit) const = 0;

  // Frames with this label, ascending.
  virtual std::vector<FrameId> labelled(const std::string& label) const = 0;
  // Labels that begin with `prefix`, ascending.
  virtual std::vector<std::string> labels(const std::string& prefix) const = 0;
};

// How many sessions there are, without those that have been deleted.
std::size_t count_sessions(const Graph& graph);

// The edge `id`, or nullopt.
std::optional<Edge> find_edge(const Graph& graph, EdgeId id);

// One step of a search: an edge of the graph (accepted and carrying) and the frame at its other end.
struct Neighbour {
  EdgeId edge;
  FrameId frame;
  bool forward = false;  // walked from Edge::a to Edge::b
};
// Closures that a search takes for edges of the graph besides those that are: to ask what would be if, or those in
// force that only bind landmarks. They are verified in metres; whether they lie as densely as edges may
// (docs/method.md, 2) is not asked.
struct Supposed {
  bool candidates = false, quarantined = false, bound = false;

  bool in_graph(const Edge& edge) const {
    return edge.in_graph() ||
           (is_metric(edge.verification) &&
            ((candidates && edge.state == EdgeState::kCandidate) ||
             (quarantined && edge.state == EdgeState::kQuarantined) || (bound && edge.state == EdgeState::kAccepted)));
  }
};
// The neighbours of a frame in increasing edge id (docs/method.md, 2). `hot` is graph.hot(id).
std::vector<Neighbour> neighbours(const Graph& graph, FrameId id, const FrameHot& hot, Supposed supposed = {});

// The frame after this one in its session; nullopt at the last. Frames are joined by their motion, so a gap of any
// length is stepped over at once. `hot` is graph.hot(id).
std::optional<FrameId> next_in_session(FrameId id, const FrameHot& hot);

}  // namespace relmap::storage
