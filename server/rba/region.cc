#include "server/rba/region.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/rba/measurement.h"

namespace relmap::rba {

namespace {

const double kMinParallaxCosine = std::cos(std::numbers::pi / 180);  // one degree
// Odometry steps to either side of an active frame within which frames may have landmarks on the other side of it: half
// the spacing of loop edges.
constexpr int kAround = 8;

// Cosine of the angle between the ray to the landmark in the base and the measured ray in the observing frame.
double parallax_cosine(const ProblemLandmark& landmark, const ProblemObservation& observation,
                       const StereoCamera& camera, const SE3& T_ij) {
  const Vector3 in_frame((observation.z.x() - camera.cx) / camera.f, (observation.z.y() - camera.cy) / camera.f, 1);
  return ray(landmark.abr).normalized().dot(T_ij.R.transpose() * in_frame.normalized());
}

}  // namespace

void Region::clear() {
  active_.clear();
  active_frames_.clear();
  free_.clear();
  free_landmarks_.clear();
  loaded_landmarks_ = 0;
  loaded_around_ = 0;
  tree_nodes_.clear();
  ends_.clear();
  paths_.clear();
}

template <typename Key>
void Region::sort_by(std::size_t size, std::size_t count, const Key& key, std::vector<std::int32_t>* first,
                     std::vector<std::int32_t>* items) {
  first->assign(size + 1, 0);
  for (std::size_t k = 0; k < count; ++k)
    if (key(k) >= 0) ++(*first)[static_cast<std::size_t>(key(k)) + 1];
  for (std::size_t k = 0; k < size; ++k) (*first)[k + 1] += (*first)[k];
  items->resize(static_cast<std::size_t>(first->back()));
  next_.assign(first->begin(), first->end() - 1);
  for (std::size_t k = 0; k < count; ++k)
    if (key(k) >= 0) (*items)[static_cast<std::size_t>(next_[key(k)]++)] = static_cast<std::int32_t>(k);
}

void Region::activate(std::int32_t frame) {
  active_.resize(std::max(active_.size(), local_.frames.size()));
  if (active_[frame]) return;
  active_[frame] = 1;
  active_frames_.push_back(frame);
  local_.load_observations(frame);
  free_.resize(local_.landmarks.size());
  const LocalView loaded = local_.view(frame);
  for (std::int32_t o = loaded.first; o < loaded.end; ++o) free_landmark(local_.observations[o].landmark);
}

void Region::free_landmark(std::int32_t landmark) {
  if (free_[landmark] || is_held(landmark)) return;
  free_[landmark] = 1;
  free_landmarks_.push_back(landmark);
}

void Region::load() {
  for (; loaded_landmarks_ < free_landmarks_.size(); ++loaded_landmarks_)
    local_.load_observers(free_landmarks_[loaded_landmarks_]);
  for (; loaded_around_ < active_frames_.size(); ++loaded_around_) {
    const std::int32_t frame = active_frames_[loaded_around_];
    const LocalView seen = local_.view(frame);
    bool held = false;
    for (std::int32_t o = seen.first; o < seen.end && !held; ++o) held = is_held(local_.observations[o].landmark);
    if (!held) continue;
    load_along_motion(frame, false);
    load_along_motion(frame, true);
  }
  free_.resize(local_.landmarks.size());
  active_.resize(local_.frames.size());
}

void Region::load_along_motion(std::int32_t frame, bool forward) {
  for (int step = 0; step < kAround && frame >= 0; ++step) {
    std::int32_t next = -1;
    for (const storage::LocalStep& to : local_.steps(frame))
      if (local_.edges[to.edge].id.ordinal == 0 && to.forward == forward) next = to.frame;
    if (next >= 0) local_.load_observations(next);
    frame = next;
  }
}

void Region::sort_observations() {
  sort_by(
      local_.landmarks.size(), local_.observations.size(),
      [&](std::size_t o) { return local_.observations[o].landmark; }, &first_of_landmark_, &by_landmark_);
  sort_by(
      local_.frames.size(), local_.landmarks.size(),
      [&](std::size_t l) {
        return first_of_landmark_[l] < first_of_landmark_[l + 1] ? local_.landmarks[l].base : std::int32_t{-1};
      },
      &first_of_base_, &by_base_);
  const std::size_t bases = local_.frames.size();
  paths_.resize(bases);
  node_at_.assign(bases, -1);
  for (std::size_t base = 0; base < bases; ++base) {
    observers_.clear();
    for (std::int32_t k = first_of_base_[base]; k < first_of_base_[base + 1]; ++k)
      for (std::int32_t o = first_of_landmark_[by_base_[k]]; o < first_of_landmark_[by_base_[k] + 1]; ++o) {
        const std::int32_t observer = local_.observations[by_landmark_[o]].frame;
        if (std::exchange(node_at_[observer], 0) < 0) observers_.push_back(observer);
      }
    for (const std::int32_t observer : observers_) node_at_[observer] = -1;
    if (paths_[base].ends == observers_.size()) continue;  // the same ones: until clear() they are only added
    const std::size_t first_node = tree_nodes_.size(), first_end = ends_.size();
    observer_ends_.clear();
    local_.path_tree(static_cast<std::int32_t>(base), observers_, &tree_nodes_, &observer_ends_);
    for (std::size_t k = 0; k < observers_.size(); ++k) ends_.push_back({observers_[k], observer_ends_[k]});
    paths_[base] = {first_node, tree_nodes_.size() - first_node, first_end, observers_.size()};
  }
  // path_tree() may have loaded more frames; none of them has observations here.
  active_.resize(local_.frames.size());
}

bool Region::free_what_moves() {
  const std::size_t before = free_landmarks_.size();
  node_at_.assign(local_.frames.size(), -1);
  for (std::size_t base = 0; base < paths_.size(); ++base) {
    const Tree nodes = tree(base);
    if (nodes.empty()) continue;
    moves_.assign(nodes.size(), 0);
    bool any = false;
    for (const End& end : ends(base)) node_at_[end.frame] = end.node;
    for (std::size_t n = 1; n < nodes.size(); ++n) {
      const auto parent = static_cast<std::size_t>(nodes[n].parent);
      moves_[n] = static_cast<char>(moves_[parent] || active_[nodes[n].frame] || active_[nodes[parent].frame]);
      any = any || moves_[n];
    }
    if (any) {
      for (std::int32_t k = first_of_base_[base]; k < first_of_base_[base + 1]; ++k) {
        const std::int32_t landmark = by_base_[k];
        if (free_[landmark] || is_held(landmark)) continue;
        for (std::int32_t o = first_of_landmark_[landmark]; o < first_of_landmark_[landmark + 1]; ++o) {
          const std::int32_t node = node_at_[local_.observations[by_landmark_[o]].frame];
          if (node >= 0 && moves_[node]) free_landmark(landmark);
        }
      }
    }
    for (const End& end : ends(base)) node_at_[end.frame] = -1;
  }
  return free_landmarks_.size() > before;
}

void Region::build(Problem* problem) {
  do {
    load();
    sort_observations();
  } while (free_what_moves());

  problem->cameras = local_.cameras;
  problem->edges.clear();
  problem->nodes.clear();
  problem->bases.clear();
  problem->landmarks.clear();
  problem->observations.clear();
  landmark_of_problem_.clear();
  edge_of_problem_.clear();
  problem_edge_.assign(local_.edges.size(), -1);
  for (std::size_t base = 0; base < paths_.size(); ++base)
    if (!tree(base).empty()) lay_out_base(static_cast<std::int32_t>(base), problem);
  choose_measurements(problem);
  choose_columns(problem);
}

void Region::lay_out_base(std::int32_t base, Problem* problem) {
  ProblemBase flat;
  flat.first_node = static_cast<std::int32_t>(problem->nodes.size());
  for (const End& end : ends(static_cast<std::size_t>(base)))
    node_at_[end.frame] = end.node < 0 ? -1 : flat.first_node + end.node;
  for (const LocalMap::TreeNode& node : tree(static_cast<std::size_t>(base))) {
    ProblemNode& added = problem->nodes.emplace_back();
    if (node.parent < 0) continue;
    added.parent = flat.first_node + node.parent;
    added.forward = node.forward;
    if (problem_edge_[node.edge] < 0) {
      problem_edge_[node.edge] = static_cast<std::int32_t>(problem->edges.size());
      edge_of_problem_.push_back(node.edge);
      problem->edges.emplace_back().T_ab = local_.estimate(node.edge).T_ab;
    }
    added.edge = problem_edge_[node.edge];
  }
  flat.end_node = static_cast<std::int32_t>(problem->nodes.size());
  flat.first_landmark = static_cast<std::int32_t>(problem->landmarks.size());
  for (const bool free : {true, false}) {
    for (std::int32_t k = first_of_base_[base]; k < first_of_base_[base + 1]; ++k) {
      const std::int32_t landmark = by_base_[k];
      if (static_cast<bool>(free_[landmark]) != free) continue;
      const LocalLandmark& local = local_.landmarks[landmark];
      ProblemLandmark point;
      point.abr = local.abr;
      point.depth_prior = local.depth_prior;
      point.first_observation = static_cast<std::int32_t>(problem->observations.size());
      for (std::int32_t o = first_of_landmark_[landmark]; o < first_of_landmark_[landmark + 1]; ++o) {
        const LocalObservation& seen = local_.observations[by_landmark_[o]];
        if (node_at_[seen.frame] < 0) continue;  // no path
        problem->observations.push_back({seen.z, seen.information, node_at_[seen.frame], seen.frame,
                                         local_.view(seen.frame).camera, seen.mono, free || is_held(landmark)});
      }
      point.end_observation = static_cast<std::int32_t>(problem->observations.size());
      problem->landmarks.push_back(point);
      landmark_of_problem_.push_back(landmark);
    }
    if (free) flat.end_free = static_cast<std::int32_t>(problem->landmarks.size());
  }
  flat.end_landmark = static_cast<std::int32_t>(problem->landmarks.size());
  for (const End& end : ends(static_cast<std::size_t>(base))) node_at_[end.frame] = -1;
  problem->bases.push_back(flat);
}

void Region::choose_measurements(Problem* problem) {
  problem->compose(&poses_);
  // A point behind the camera has no prediction to start from.
  const auto count = [&](const ProblemLandmark& point, ProblemObservation& seen) {
    return seen.counted = seen.counted && scaled_point(poses_[seen.node], point.abr).z() > kMinDepthRatio;
  };
  for (ProblemBase& base : problem->bases) {
    for (std::int32_t l = base.end_free; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem->landmarks[l];
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o)
        count(point, problem->observations[o]);
    }
    std::int32_t keep = base.first_landmark;  // end of the free landmarks that are measured, moved to the front
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l) {
      ProblemLandmark& point = problem->landmarks[l];
      bool measured = false, all_mono = true;
      double min_cosine = 1;  // of the parallax
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
        ProblemObservation& observation = problem->observations[o];
        if (!count(point, observation)) continue;
        measured = true;
        all_mono = all_mono && observation.mono;
        if (all_mono)
          min_cosine = std::min(min_cosine, parallax_cosine(point, observation, problem->cameras[observation.camera],
                                                            poses_[observation.node]));
      }
      if (!measured) continue;
      point.depth_prior = all_mono && min_cosine > kMinParallaxCosine;
      std::swap(problem->landmarks[keep], problem->landmarks[l]);
      std::swap(landmark_of_problem_[keep], landmark_of_problem_[l]);
      ++keep;
    }
    base.end_free = keep;
  }
}

void Region::choose_columns(Problem* problem) {
  // `uses_`: how many counted measurements have each edge on their path.
  beyond_.assign(problem->nodes.size(), 0);
  uses_.assign(problem->edges.size(), 0);
  for (const ProblemBase& base : problem->bases) {
    for (std::int32_t l = base.first_landmark; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem->landmarks[l];
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o)
        beyond_[problem->observations[o].node] += problem->observations[o].counted;
    }
    for (std::int32_t n = base.end_node - 1; n > base.first_node; --n) {
      uses_[problem->nodes[n].edge] += beyond_[n];
      beyond_[problem->nodes[n].parent] += beyond_[n];
    }
  }
  problem->columns = 0;
  edge_of_column_.clear();
  for (std::size_t e = 0; e < problem->edges.size(); ++e) {
    const storage::LocalEdge& local = local_.edges[edge_of_problem_[e]];
    ProblemEdge& edge = problem->edges[e];
    if (uses_[e] == 0 || !(is_active(local.a) || is_active(local.b))) continue;
    edge.column = problem->columns++;
    edge_of_column_.push_back(edge_of_problem_[e]);
  }
  count_across_columns(problem);
  support_.compute(*problem);
  for (ProblemEdge& edge : problem->edges) {
    if (edge.column < 0) continue;
    const storage::Edge& record = *local_.edges[edge_of_column_[edge.column]].record;
    const bool measured = !record.prior_active && is_measured(edge.column);
    if (measured && (record.kind != storage::EdgeKind::kOdometry || own_step_ == 0)) continue;
    const Eigen::LLT<Matrix6> cholesky(record.prior_covariance);
    edge.prior_T_ab = record.prior_T_ab;
    edge.prior_information = cholesky.solve(Matrix6::Identity());
    if (measured) edge.prior_information *= own_step_;
    edge.prior_doubted = measured;
    edge.prior = cholesky.info() == Eigen::Success && edge.prior_information.allFinite();
  }
}

void Region::count_across_columns(Problem* problem) {
  moves_.assign(problem->nodes.size(), 0);
  for (const ProblemBase& base : problem->bases) {
    if (base.end_free == base.end_landmark) continue;
    for (std::int32_t n = base.first_node + 1; n < base.end_node; ++n) {
      const ProblemNode& node = problem->nodes[n];
      moves_[n] = static_cast<char>(moves_[node.parent] || problem->edges[node.edge].column >= 0);
    }
    for (std::int32_t l = base.end_free; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem->landmarks[l];
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
        ProblemObservation& seen = problem->observations[o];
        seen.counted = seen.counted && moves_[seen.node];
      }
    }
  }
}

void Region::take(const Problem& problem) {
  for (std::size_t e = 0; e < problem.edges.size(); ++e) {
    if (problem.edges[e].column < 0) continue;
    EdgeEstimate& local = local_.estimate(edge_of_problem_[e]);
    const SE3& solved = problem.edges[e].T_ab;
    local.changed = local.changed || local.T_ab.R != solved.R || local.T_ab.t != solved.t;
    local.T_ab = solved;
  }
  for (const ProblemBase& base : problem.bases)
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l) {
      LocalLandmark& local = local_.landmarks[landmark_of_problem_[l]];
      const ProblemLandmark& solved = problem.landmarks[l];
      local.changed = local.changed || local.abr != solved.abr || local.depth_prior != solved.depth_prior;
      local.abr = solved.abr;
      local.depth_prior = solved.depth_prior;
    }
}

void Region::far_from_boundary(const Problem& problem, std::uint32_t distance, std::vector<char>* far) {
  // `depth_`: number of the problem's edges to the nearest static frame, at most `distance`.
  depth_.assign(local_.frames.size(), distance);
  for (const ProblemObservation& seen : problem.observations)
    if (seen.counted && !is_active(seen.frame)) depth_[seen.frame] = 0;
  // A frame next to an active one along the odometry is static even if no measurement from it counts. (The frame at the
  // other end of a loop edge from which nothing counts is fixed: it is known better than what is solved for.)
  for (const std::int32_t e : edge_of_column_) {
    if (local_.edges[e].id.ordinal != 0) continue;
    for (const std::int32_t end : {local_.edges[e].a, local_.edges[e].b})
      if (!is_active(end)) depth_[end] = 0;
  }
  for (std::uint32_t round = 1; round < distance; ++round)
    for (const std::int32_t e : edge_of_problem_) {
      std::uint32_t &a = depth_[local_.edges[e].a], &b = depth_[local_.edges[e].b];
      a = std::min(a, b + 1);
      b = std::min(b, a + 1);
    }
  far->resize(static_cast<std::size_t>(problem.columns));
  for (std::int32_t c = 0; c < problem.columns; ++c) {
    const storage::LocalEdge& edge = local_.edges[edge_of_column_[c]];
    (*far)[c] = static_cast<char>(std::min(depth_[edge.a], depth_[edge.b]) >= distance);
  }
}

void Region::previous_columns(std::vector<std::int32_t>* previous) const {
  previous->assign(edge_of_column_.size(), -1);
  for (std::size_t c = 0; c < edge_of_column_.size(); ++c)
    for (std::size_t p = 0; p < edge_of_column_.size(); ++p) {
      const storage::Edge &edge = *local_.edges[edge_of_column_[c]].record,
                          &before = *local_.edges[edge_of_column_[p]].record;
      if (edge.id.ordinal == 0 && before.id.ordinal == 0 && before.b == edge.a)
        (*previous)[c] = static_cast<std::int32_t>(p);
    }
}

}  // namespace relmap::rba
