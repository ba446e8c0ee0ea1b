// The edges that hold a picture of the map together, as springs: what counts, and how much. Pictures and exports of the
// map count the same.
//
// A measured step of a robot's motion, and a closure that is an edge of the graph and in force, count with their
// covariance; a step that nothing measured only where no measured edges connect its ends; a step along which a lift or
// a train carried the robot likewise, and next to nothing.
#pragma once

#include <unordered_map>
#include <vector>

#include "client/map_types.h"
#include "client/relaxation.h"
#include "client/skeleton.h"

namespace relmap::client {

struct Spring {
  EdgeId edge;  // invalid: a stretch of a session's motion, of several steps
  EdgeKind kind = EdgeKind::kOdometry;
  bool doubtful = false;  // a step that nothing measured, or along which the robot was carried
  bool pulls = true;      // false: a doubtful step that does not count, since measured edges connect its ends
  RelaxationEdge relaxed;
};

// The covariance of a step along which the robot was carried: so large that the step does not matter beside what
// closures measured, but finite, so that the solution is unique.
const Matrix6& carried_covariance();

// The sets of frames that measured edges connect (union-find).
class MeasuredSets {
 public:
  void connect(FrameId a, FrameId b) { parent_[root(a)] = root(b); }
  bool join(FrameId a, FrameId b) { return root(a) == root(b); }

 private:
  FrameId root(FrameId frame);
  std::unordered_map<FrameId, FrameId> parent_;
};

// An edge of the graph that is in force.
inline bool in_graph(const Edge& edge) { return edge.state == EdgeState::kAccepted && edge.carries; }
// Motion that nothing measured, or along which the robot was carried.
inline bool is_doubtful(const Edge& edge) { return edge.unmeasured || !edge.carried_by.empty(); }

// Sets Spring::pulls, and returns what measured edges connect.
MeasuredSets choose_pulling(std::vector<Spring>& springs);

// The covariance with these traces, m^2 and rad^2, that is the same in all directions: a skeleton tells no more.
Matrix6 isotropic_covariance(double translation_trace, double rotation_trace);

// Those of edges of the map that are in the graph; without steps of which nothing is known.
std::vector<Spring> springs_of(const std::vector<Edge>& edges);

// A closure of a skeleton, whether or not it is in force.
Spring spring_of(const Skeleton::Closure& closure);

// Those of a skeleton. Closures whose ends are no points, because the skeleton is not read whole, are left out.
std::vector<Spring> springs_of(const Skeleton& skeleton);

}  // namespace relmap::client
