// Random problems for tests: frames on a bending path, edges stored in either direction, a loop edge, tracks of two to
// nine frames seen from bases before, among and behind the moving edges, some measurements mono, some edges with
// priors.
#pragma once

#include <algorithm>
#include <cmath>
#include <queue>
#include <random>
#include <vector>

#include "server/rba/measurement.h"
#include "server/rba/problem.h"

namespace relmap::rba {

struct ProblemSample {
  int frames = 14;
  int first_moving = 3, end_moving = 10;  // frames; an edge moves if one of its ends does
  int landmarks_per_frame = 12;
  bool loop = true;  // an edge between frames 2 and frames - 2
  double mono_share = 0.2;
  double pixel_noise = 1;
  double state_noise = 0.01;  // of edges (m, rad); landmarks are disturbed accordingly
  unsigned seed = 1;

  Problem make() const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const auto disturbance = [&](double size) {
      Vector6 xi;
      for (int k = 0; k < 6; ++k) xi[k] = size * normal(random);
      return SE3::exp(xi);
    };
    Problem problem;
    problem.cameras.push_back({400, 256, 192, 0.12, 512, 384});
    std::vector<SE3> truth;  // T_world_frame
    for (int i = 0; i < frames; ++i) {
      Vector6 step;
      step << 0.05, 0.01 * normal(random), 0.2, 0.01 * normal(random), 0.05, 0.01 * normal(random);
      truth.push_back(i == 0 ? SE3() : truth.back() * SE3::exp(step));
    }
    struct Ends {
      int a, b;
    };
    std::vector<Ends> ends;
    for (int i = 1; i < frames; ++i) ends.push_back(i % 3 == 0 ? Ends{i, i - 1} : Ends{i - 1, i});
    if (loop) ends.push_back({2, frames - 2});
    const auto moves = [&](int i) { return i >= first_moving && i < end_moving; };
    for (const Ends& e : ends) {
      ProblemEdge edge;
      edge.prior_T_ab = truth[e.a].inverse() * truth[e.b];
      edge.T_ab = edge.prior_T_ab * disturbance(state_noise);
      if (moves(e.a) || moves(e.b)) edge.column = problem.columns++;
      edge.prior = problem.edges.size() % 4 <= 1;
      edge.prior_doubted = problem.edges.size() % 4 == 0;
      edge.prior_information.diagonal() << 1e4, 2e4, 3e4, 4e5, 5e5, 6e5;
      problem.edges.push_back(edge);
    }
    for (int base = 0; base < frames; ++base) {
      ProblemBase flat;
      flat.first_node = static_cast<std::int32_t>(problem.nodes.size());
      std::vector<int> node_of(frames, -1);
      std::queue<int> open;
      problem.nodes.push_back({});
      node_of[base] = flat.first_node;
      open.push(base);
      while (!open.empty()) {
        const int x = open.front();
        open.pop();
        for (std::size_t e = 0; e < ends.size(); ++e) {
          if (ends[e].a != x && ends[e].b != x) continue;
          const int y = ends[e].a == x ? ends[e].b : ends[e].a;
          if (node_of[y] >= 0) continue;
          node_of[y] = static_cast<std::int32_t>(problem.nodes.size());
          problem.nodes.push_back({node_of[x], static_cast<std::int32_t>(e), ends[e].a == x});
          open.push(y);
        }
      }
      // Some frames are reached by a second path too: over the edge that closes the cycle, and back along the tree.
      std::vector<int> again(frames, -1);
      for (std::size_t e = 0; e < ends.size(); ++e) {
        const auto edge_of = [&](int frame) { return problem.nodes[node_of[frame]].edge; };
        auto edge = static_cast<std::int32_t>(e);
        if (edge_of(ends[e].a) == edge || edge_of(ends[e].b) == edge) continue;
        int from = ends[e].a, at = ends[e].b, node = node_of[from];
        for (int step = 0; step < 5 && at != base; ++step) {
          problem.nodes.push_back({node, edge, ends[edge].a == from});
          node = again[at] = static_cast<int>(problem.nodes.size()) - 1;
          edge = edge_of(at);
          from = at;
          at = ends[edge].a == from ? ends[edge].b : ends[edge].a;
        }
      }
      flat.end_node = static_cast<std::int32_t>(problem.nodes.size());
      flat.first_landmark = static_cast<std::int32_t>(problem.landmarks.size());
      for (int k = 0; k < landmarks_per_frame; ++k)
        add_landmark(truth, k % 3 == 0 ? merged(node_of, again) : node_of, base, &random, &problem);
      // The last one is held.
      flat.end_landmark = static_cast<std::int32_t>(problem.landmarks.size());
      flat.end_free = std::max(flat.first_landmark, flat.end_landmark - 1);
      problem.bases.push_back(flat);
    }
    return problem;
  }

 private:
  static std::vector<int> merged(std::vector<int> node_of, const std::vector<int>& again) {
    for (std::size_t i = 0; i < again.size(); ++i)
      if (again[i] >= 0) node_of[i] = again[i];
    return node_of;
  }
  void add_landmark(const std::vector<SE3>& truth, const std::vector<int>& node_of, int base, std::mt19937* random,
                    Problem* problem) const {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const StereoCamera& camera = problem->cameras[0];
    ProblemLandmark landmark;
    landmark.first_observation = static_cast<std::int32_t>(problem->observations.size());
    const Vector3 abr(uniform(*random) - 0.5, uniform(*random) - 0.5, 0.1 + 0.4 * uniform(*random));
    const Vector3 world = truth[base] * Vector3(ray(abr) / abr.z());
    const int last = base + 2 + static_cast<int>(7 * uniform(*random));
    const bool all_mono = uniform(*random) < mono_share / 2;
    const auto frames_of = static_cast<int>(truth.size());
    for (int i = base; i < std::min(last, frames_of); ++i) {
      const Vector3 p = truth[i].inverse() * world;
      if (p.z() < 0.3) break;
      ProblemObservation observation;
      observation.z = camera.project(p);
      for (int k = 0; k < 3; ++k) observation.z[k] += pixel_noise * normal(*random);
      observation.information = i % 5 == 4 ? 0.25 : 1;
      observation.node = node_of[i];
      observation.frame = i;
      observation.mono = all_mono || uniform(*random) < mono_share;
      observation.counted = uniform(*random) < 0.95;
      problem->observations.push_back(observation);
    }
    landmark.end_observation = static_cast<std::int32_t>(problem->observations.size());
    landmark.depth_prior = all_mono;
    landmark.abr = abr + state_noise * Vector3(normal(*random), normal(*random), normal(*random));
    bool measured = false;
    for (std::int32_t o = landmark.first_observation; o < landmark.end_observation; ++o)
      measured = measured || (problem->observations[o].counted && (all_mono || !problem->observations[o].mono));
    if (!measured) {
      problem->observations.resize(landmark.first_observation);
      return;
    }
    problem->landmarks.push_back(landmark);
  }
};

}  // namespace relmap::rba
