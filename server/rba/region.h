// The active region of a relaxation, and the problem that it poses (docs/method.md, 4).
//
// An edge moves iff at least one of its ends is active. A landmark is free iff an active frame sees it, or a path of
// one of its observations uses a moving edge: so the region is closed under the paths of its observations. Frames that
// see free landmarks but are not active are static: their measurements count, their edges do not move unless an active
// frame is at the other end.
#pragma once

#include <cstdint>
#include <vector>

#include "server/rba/local_map.h"
#include "server/rba/problem.h"

namespace relmap::rba {

class Region {
 public:
  // At most `max_observations` of a landmark enter a solve.
  Region(LocalMap& local, std::uint32_t max_observations) : local_(local), max_observations_(max_observations) {}

  void activate(std::int32_t frame);
  bool is_active(std::int32_t frame) const {
    return static_cast<std::size_t>(frame) < active_.size() && active_[frame];
  }
  // In the order of activation.
  const std::vector<std::int32_t>& active() const { return active_frames_; }

  // Loads what the region needs and lays its problem out. ProblemObservation::frame is the local frame.
  void build(Problem* problem);
  // Takes the solution of the problem last built over into the local map. `changed` are set where bits differ.
  void take(const Problem& problem);

  // Moving edges at least `distance` edges away from every static frame (all, if there is none), by column: near the
  // boundary a marginal covariance is overconfident, since what is beyond it is taken as known.
  std::vector<bool> far_from_boundary(const Problem& problem, std::uint32_t distance);
  // By column: that of the odometry edge which ends where this one, an odometry edge, begins; -1: none moves there.
  std::vector<std::int32_t> previous_columns() const;
  // Local edge of a column.
  std::int32_t edge_of_column(std::int32_t column) const { return edge_of_column_[column]; }

 private:
  void load();
  bool free_what_moves();
  void sort_observations();
  void free_landmark(std::int32_t landmark);
  void lay_out_base(std::int32_t base, Problem* problem);
  void choose_measurements(const std::vector<SE3>& poses, Problem* problem);
  void choose_columns(Problem* problem);

  LocalMap& local_;
  std::uint32_t max_observations_;
  std::vector<char> active_;  // by local frame
  std::vector<std::int32_t> active_frames_;
  std::vector<char> free_;  // by local landmark
  std::vector<std::int32_t> free_landmarks_;
  std::size_t loaded_landmarks_ = 0;  // of free_landmarks_: observers loaded

  // Local observations by landmark, and landmarks that have some by base.
  std::vector<std::int32_t> first_of_landmark_, by_landmark_;
  std::vector<std::int32_t> first_of_base_, by_base_;
  std::vector<std::vector<LocalMap::TreeNode>> trees_;  // by local frame; empty: no landmark is based there

  // Of the problem last built.
  std::vector<std::int32_t> landmark_of_problem_;
  std::vector<std::int32_t> edge_of_problem_, edge_of_column_;
  std::vector<std::int32_t> problem_edge_;  // by local edge; -1: not in it
  std::vector<std::int32_t> node_at_;       // by local frame: node of the present base's tree, -1: none
};

}  // namespace relmap::rba
