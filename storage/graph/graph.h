// The relative graph as algorithms see it: frames by id, whether they are in memory or on disk.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "storage/graph/chunk.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

// Numbers of sessions, without those that have been deleted.
struct SessionCounts {
  std::size_t all = 0;
  std::size_t oneway = 0;

  void add(const Session& session) {
    if (is_deleted(session)) return;
    ++all;
    if (session.header.oneway) ++oneway;
  }
  void remove(const Session& session) {
    if (is_deleted(session)) return;
    --all;
    if (session.header.oneway) --oneway;
  }
};

// Reads throw StatusError (IO_ERROR, DATA_LOSS, VIEW_EXPIRED, BUDGET_EXCEEDED). A returned part stays valid and
// unchanged for as long as it is held, whatever happens to the map.
class Graph {
 public:
  virtual ~Graph() = default;

  // Null if there is no such frame.
  virtual std::shared_ptr<const FrameHot> hot(FrameId id) const = 0;
  // The hot parts of all frames of a chunk; cheaper than one by one.
  virtual Slots<FrameHot> hot_frames(ChunkId chunk) const;
  virtual std::shared_ptr<const FrameWarm> warm(FrameId id) const = 0;
  virtual std::shared_ptr<const FrameCold> cold(FrameId id) const = 0;

  // Visits the sessions from number `from` on in ascending order, deleted ones too, until `visit` returns false. They
  // may be far more than memory holds.
  using SessionVisit = std::function<bool(const Session&)>;
  virtual void visit_sessions(SessionNumber from, const SessionVisit& visit) const = 0;
  // All of these at once, for maps of which it is known that they have few.
  std::vector<Session> sessions() const;
  virtual SessionCounts session_counts() const;
  virtual std::optional<Session> session(SessionNumber number) const = 0;
  // Visits the skipped sequences of a session in ascending order until `visit` returns false. The first visited is the
  // range that contains `sequence` or, if none does, the next one.
  using SkippedVisit = std::function<bool(const Skipped&)>;
  virtual void visit_skipped(SessionNumber session, std::uint32_t sequence, const SkippedVisit& visit) const = 0;

  // Frames with this label, ascending.
  virtual std::vector<FrameId> labelled(const std::string& label) const = 0;
  // Labels that begin with `prefix`, ascending.
  virtual std::vector<std::string> labels(const std::string& prefix) const = 0;
};

// The session that somebody names by its number; it may be deleted. NO_SUCH_SESSION.
Result<Session> existing_session(const Graph& graph, SessionNumber number);
// NO_SUCH_SESSION, as existing_session() says it.
Status no_such_session(SessionNumber number);

// The edge `id`, or nullopt.
std::optional<Edge> find_edge(const Graph& graph, EdgeId id);

// One step of a search: an edge of the graph (accepted and carrying) and the frame at its other end.
struct Neighbour {
  EdgeId edge;
  FrameId frame;
  bool forward = false;  // walked from Edge::a to Edge::b
};
// Closures that a search takes for edges of the graph besides those that are: to ask what would be if candidates or
// quarantined closures were accepted, or to include accepted ones that only bind landmarks (`bound`). They must be
// metric; whether they lie as densely as edges may (docs/method.md, 2) is not checked.
struct Supposed {
  bool candidates = false, quarantined = false, bound = false;

  bool in_graph(const Edge& edge) const {
    return edge.in_graph() ||
           (is_metric(edge.verification) &&
            ((candidates && edge.state == EdgeState::kCandidate) ||
             (quarantined && edge.state == EdgeState::kQuarantined) || (bound && edge.state == EdgeState::kAccepted)));
  }
};
// The neighbours of frame `id` in increasing order of edge id (docs/method.md, 2). `hot` is graph.hot(id).
std::vector<Neighbour> neighbours(const Graph& graph, FrameId id, const FrameHot& hot, Supposed supposed = {});

// The next frame in the session; nullopt at the last. An odometry edge leads to it, so a gap of any length is crossed
// in one step. `hot` is graph.hot(id).
std::optional<FrameId> next_in_session(FrameId id, const FrameHot& hot);

}  // namespace relmap::storage
