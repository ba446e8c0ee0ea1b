// The active region of a relaxation, and the problem that it poses (docs/method.md, 4).
//
// An edge moves iff at least one of its ends is active. A landmark is free iff an active frame sees it, or a path of
// one of its observations uses a moving edge: so the region is closed under the paths of its observations. Frames that
// see free landmarks but are not active are static: their measurements count, their edges do not move unless an active
// frame is at the other end.
//
// Settled landmarks are held instead: what is seen of them across a moving edge measures that edge, in active frames
// and in those next to them. So a place that has been passed a thousand times costs no more than one passed a few
// times. Landmarks of frozen sessions are held whatever happens, and their frames are never active.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/rba/local_map.h"
#include "server/rba/problem.h"

namespace relmap::rba {

class Region {
 public:
  explicit Region(LocalMap& local) : local_(local) {}

  // Whether settled landmarks are held, as they are unless said otherwise. Before anything is activated.
  void hold_settled(bool held) { hold_settled_ = held; }

  void activate(std::int32_t frame);
  bool is_active(std::int32_t frame) const {
    return static_cast<std::size_t>(frame) < active_.size() && active_[frame];
  }
  // In the order of activation.
  const std::vector<std::int32_t>& active() const { return active_frames_; }

  // Forgets everything, as LocalMap::clear().
  void clear();

  // Loads what the region needs and lays its problem out. ProblemObservation::frame is the local frame.
  void build(Problem* problem);
  // Takes the solution of the problem last built over into the local map. `changed` are set where bits differ.
  void take(const Problem& problem);

  // Moving edges at least `distance` edges away from every static frame (all, if there is none), by column: near the
  // boundary a marginal covariance is overconfident, since what is beyond it is taken as known.
  void far_from_boundary(const Problem& problem, std::uint32_t distance, std::vector<char>* far);
  // By column: that of the odometry edge which ends where this one, an odometry edge, begins; -1: none moves there.
  void previous_columns(std::vector<std::int32_t>* previous) const;
  // Local edge of a column.
  std::int32_t edge_of_column(std::int32_t column) const { return edge_of_column_[column]; }

 private:
  using Tree = std::span<const LocalMap::TreeNode>;
  // Where the path to an observer ends.
  struct End {
    std::int32_t frame = -1;
    std::int32_t node = -1;  // of its base's tree; -1: out of reach
  };

  void load();
  void load_along_motion(std::int32_t frame, bool forward);
  bool is_held(std::int32_t landmark) const {
    return local_.landmarks[landmark].frozen || (hold_settled_ && local_.landmarks[landmark].settled);
  }
  bool free_what_moves();
  void sort_observations();
  void free_landmark(std::int32_t landmark);
  void lay_out_base(std::int32_t base, Problem* problem);
  void choose_measurements(Problem* problem);
  void choose_columns(Problem* problem);
  // Of held landmarks only what is seen across a moving edge counts.
  void count_across_columns(Problem* problem);
  // The paths from a base to all who observe its landmarks; empty: no landmark is based there.
  Tree tree(std::size_t base) const {
    return Tree(tree_nodes_).subspan(first_of_tree_[base], first_of_tree_[base + 1] - first_of_tree_[base]);
  }
  std::span<const End> ends(std::size_t base) const {
    return std::span<const End>(ends_).subspan(first_end_[base], first_end_[base + 1] - first_end_[base]);
  }
  // Counting sort: the items with keys[item] == k, for k = 0 .. size - 1, ascending, stand in items[first[k] ..
  // first[k + 1]). Items with a negative key are left out.
  template <typename Key>
  void sort_by(std::size_t size, std::size_t count, const Key& key, std::vector<std::int32_t>* first,
               std::vector<std::int32_t>* items);

  LocalMap& local_;
  bool hold_settled_ = true;
  std::vector<char> active_;  // by local frame
  std::vector<std::int32_t> active_frames_;
  std::vector<char> free_;  // by local landmark
  std::vector<std::int32_t> free_landmarks_;
  std::size_t loaded_landmarks_ = 0;  // of free_landmarks_: observers loaded
  std::size_t loaded_around_ = 0;     // of active_frames_: frames next to them loaded, if they see held landmarks

  // Local observations by landmark, and landmarks that have some by base.
  std::vector<std::int32_t> first_of_landmark_, by_landmark_;
  std::vector<std::int32_t> first_of_base_, by_base_;
  std::vector<LocalMap::TreeNode> tree_nodes_;
  std::vector<std::size_t> first_of_tree_;  // by local frame
  std::vector<End> ends_;
  std::vector<std::size_t> first_end_;  // the same

  // Of the problem last built.
  std::vector<std::int32_t> landmark_of_problem_;
  std::vector<std::int32_t> edge_of_problem_, edge_of_column_;
  std::vector<std::int32_t> problem_edge_;  // by local edge; -1: not in it

  // Scratch.
  std::vector<std::int32_t> next_, observers_, observer_ends_, beyond_, uses_;
  std::vector<std::int32_t> node_at_;  // by local frame: node of the present base's tree, -1: none
  std::vector<char> moves_;            // by node of it
  std::vector<std::uint32_t> depth_;   // by local frame
  std::vector<SE3> poses_;
};

}  // namespace relmap::rba
