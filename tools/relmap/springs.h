// The edges that hold a picture of the map together, as springs, and what it does to them. How each counts is said in
// relaxed_map.h.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "client/map_types.h"
#include "client/relaxation.h"

namespace relmap::cli {

struct Spring {
  EdgeId edge;  // invalid: a stretch of a session's motion, of several steps
  client::EdgeKind kind = client::EdgeKind::kOdometry;
  bool doubtful = false;  // a step that nothing measured, or along which the robot was carried
  bool pulls = true;      // false: a doubtful step that does not count, since measured edges connect its ends
  client::RelaxationEdge relaxed;
};

// The covariance of a step along which a lift or a train carried the robot: so large that the step does not matter
// beside what closures measured, but finite, so that the solution is unique.
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

// Sets Spring::pulls, and returns what measured edges connect.
MeasuredSets choose_pulling(std::vector<Spring>& springs);

// An edge that the relaxed poses contradict. From kTearSigmas standard deviations on it is called a tear.
struct Tear {
  EdgeId edge;  // as in Spring
  FrameId a, b;
  double metres = 0, degrees = 0, sigmas = 0;

  // "3:120/1 from 1:4 to 3:120: 0.031 m, 0.10 degrees, 7.3 sigmas"
  std::string words() const;
  std::string name() const;  // "3:120/1"; of a stretch "motion"
};
inline constexpr double kTearSigmas = 6;

// By how much poses in one frame contradict `relaxed`, which stands for the spring's edge and joins the two.
Tear strain_of(const Spring& spring, const client::RelaxationEdge& relaxed, const SE3& T_root_a, const SE3& T_root_b);
void sort_worst_first(std::vector<Tear>& tears);

}  // namespace relmap::cli
