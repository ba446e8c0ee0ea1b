// The active region of a relaxation, and the bundle adjustment problem made of it (docs/method.md, 4).
//
// An edge moves iff at least one of its ends is active. A landmark is free iff an active frame sees it, or the path of
// one of its observations uses a moving edge; so the region is closed under the paths of its observations. Frames that
// see free landmarks but are not active are static: their measurements count, but their edges do not move unless an
// active frame is at the other end.
//
// Fixed landmarks are held instead. Observations of them across a moving edge measure that edge, in active frames and
// in frames next to these. So a place that has been passed a thousand times costs no more than one passed a few times.
// Landmarks of frozen sessions are always held, and frames of frozen sessions are never active.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/rba/effective_support.h"
#include "server/rba/local_map.h"
#include "server/rba/problem.h"

namespace relmap::rba {

class Region {
 public:
  // `own_step`: see RbaOptions.
  Region(LocalMap& local, double own_step) : local_(local), own_step_(own_step) {}

  // Whether fixed landmarks are held; they are by default. Call before the first activate().
  void hold_fixed(bool held) { hold_fixed_ = held; }

  void activate(std::int32_t frame);
  bool is_active(std::int32_t frame) const {
    return static_cast<std::size_t>(frame) < active_.size() && active_[frame];
  }
  // In the order of activation.
  const std::vector<std::int32_t>& active() const { return active_frames_; }

  // Empties the region. Call together with LocalMap::clear().
  void clear();

  // Loads what the region needs and lays out its problem. ProblemObservation::frame is the local frame.
  void build(Problem* problem);
  // Copies the solution of the problem last built into the local map. Sets `changed` of the edges and landmarks whose
  // values differ.
  void take(const Problem& problem);

  // By column: whether the edge is at least `distance` edges away from every static frame. Nearer to the boundary a
  // marginal covariance is overconfident, since everything beyond the boundary is taken as known. All edges are far if
  // no frame is static.
  void far_from_boundary(const Problem& problem, std::uint32_t distance, std::vector<char>* far);
  // By column of an odometry edge: the column of the odometry edge that ends where it begins; -1: none that moves.
  void previous_columns(std::vector<std::int32_t>* previous) const;
  // The local edge of a column.
  std::int32_t edge_of_column(std::int32_t column) const { return edge_of_column_[column]; }

 private:
  using Tree = std::span<const LocalMap::TreeNode>;
  // The end of the path from a base to an observer.
  struct End {
    std::int32_t frame = -1;
    std::int32_t node = -1;  // in the base's tree; -1: out of reach
  };

  // Where the paths from a base are in tree_nodes_ and ends_.
  struct Paths {
    std::size_t first_node = 0, nodes = 0, first_end = 0, ends = 0;  // one end for each observer
  };

  void load();
  void load_along_motion(std::int32_t frame, bool forward);
  bool is_held(std::int32_t landmark) const {
    return local_.landmarks[landmark].frozen || (hold_fixed_ && local_.landmarks[landmark].fixed);
  }
  // Whether the edge of a column of the problem last built needs no prior.
  bool is_measured(std::int32_t column) const { return support_.of(column) >= storage::kMinSupport; }
  bool free_what_moves();
  void sort_observations();
  void free_landmark(std::int32_t landmark);
  void lay_out_base(std::int32_t base, Problem* problem);
  void choose_measurements(Problem* problem);
  void choose_columns(Problem* problem);
  // Counts observations of held landmarks only where a moving edge is on their path.
  void count_across_columns(Problem* problem);
  // The paths from a base to all observers of its landmarks; empty if no landmark is based there.
  Tree tree(std::size_t base) const { return Tree(tree_nodes_).subspan(paths_[base].first_node, paths_[base].nodes); }
  std::span<const End> ends(std::size_t base) const {
    return std::span<const End>(ends_).subspan(paths_[base].first_end, paths_[base].ends);
  }
  // Counting sort of 0 .. count - 1 by key(item) in 0 .. size - 1: the items with key k are items[first[k] ..
  // first[k + 1]), ascending. Items with a negative key are left out.
  template <typename Key>
  void sort_by(std::size_t size, std::size_t count, const Key& key, std::vector<std::int32_t>* first,
               std::vector<std::int32_t>* items);

  LocalMap& local_;
  const double own_step_;
  bool hold_fixed_ = true;
  std::vector<char> active_;  // by local frame
  std::vector<std::int32_t> active_frames_;
  std::vector<char> free_;  // by local landmark
  std::vector<std::int32_t> free_landmarks_;
  std::size_t loaded_landmarks_ = 0;  // number of leading entries of free_landmarks_ whose observers are loaded
  std::size_t loaded_around_ = 0;     // number of leading entries of active_frames_ whose neighbours are loaded

  // Local observations sorted by landmark, and observed landmarks sorted by base.
  std::vector<std::int32_t> first_of_landmark_, by_landmark_;
  std::vector<std::int32_t> first_of_base_, by_base_;
  // The paths from bases. They are found again only when observers have been added; what was found before stays in
  // these two until clear(). No path is found more often than its base has observers.
  std::vector<LocalMap::TreeNode> tree_nodes_;
  std::vector<End> ends_;
  std::vector<Paths> paths_;  // by local frame

  // Of the problem last built:
  std::vector<std::int32_t> landmark_of_problem_;
  std::vector<std::int32_t> edge_of_problem_, edge_of_column_;
  std::vector<std::int32_t> problem_edge_;  // by local edge; -1: not in the problem

  EffectiveSupport support_;

  // Scratch.
  std::vector<std::int32_t> next_, observers_, observer_ends_, beyond_, uses_;
  std::vector<std::int32_t> node_at_;  // by local frame: its node in the tree of the base at hand; -1: none
  std::vector<char> moves_;            // by node: whether a moving edge is on its path
  std::vector<std::uint32_t> depth_;   // by local frame
  std::vector<SE3> poses_;
};

}  // namespace relmap::rba
