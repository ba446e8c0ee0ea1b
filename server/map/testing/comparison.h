// Compares a map out of which closures were taken with one that never had them (docs/method.md, 2).
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "proto/geometry/covariance.h"
#include "storage/graph/binding.h"
#include "storage/graph/graph.h"

namespace relmap::map {

// One line for each difference between two sessions, frame by frame: odometry edges and their support, landmarks in
// force, their observers.
inline std::vector<std::string> structural_differences(const storage::Graph& a, const storage::Graph& b,
                                                       SessionNumber session) {
  std::vector<std::string> differences;
  const std::uint32_t last = std::max(a.session(session)->last, b.session(session)->last);
  for (std::uint32_t i = 0; i <= last; ++i) {
    const FrameId id{session, i};
    const auto complain = [&](const std::string& what) { differences.push_back(id.to_string() + ": " + what); };
    const auto mine = a.hot(id), other = b.hot(id);
    if (!mine || !other) {
      if (mine || other) complain("is in one of them");
      continue;
    }
    const auto carrying = [](const storage::FrameHot& hot) {
      std::vector<EdgeId> ids;
      for (const storage::Edge& edge : hot.edges)
        if (edge.in_graph()) ids.push_back(edge.id);
      return ids;
    };
    if (carrying(*mine) != carrying(*other)) complain("edges");
    if (!mine->edges.empty() && !other->edges.empty() && mine->edges.front().support != other->edges.front().support)
      complain("support " + std::to_string(mine->edges.front().support) + ", " +
               std::to_string(other->edges.front().support));
    const auto seen = [&](const storage::Graph& graph) {
      std::vector<LandmarkId> landmarks;
      const auto warm = graph.warm(id);
      for (const storage::Observation& o : warm->observations)
        if (storage::closure_holds(graph, o.origin)) landmarks.push_back(storage::resolve(graph, o.landmark));
      return landmarks;
    };
    if (seen(a) != seen(b)) complain("what it sees");
    if (mine->landmarks.size() != other->landmarks.size()) {
      complain("landmarks");
      continue;
    }
    for (std::size_t slot = 0; slot < mine->landmarks.size(); ++slot)
      if (mine->landmarks[slot].observers != other->landmarks[slot].observers)
        complain("observers of landmark " + std::to_string(slot));
  }
  return differences;
}

// The largest difference of a session's steps: in standard deviations (root mean square of the six coordinates), and in
// metres and radians.
struct Difference {
  double sigmas = 0, metres = 0, radians = 0;
};
inline Difference largest_difference(const storage::Graph& a, const storage::Graph& b, SessionNumber session) {
  Difference max_difference;
  for (std::uint32_t i = 1; i <= a.session(session)->last; ++i) {
    const auto mine = a.hot({session, i}), other = b.hot({session, i});
    if (!mine || !other) continue;
    const storage::Edge& step = other->edges.front();
    const Vector6 xi = (step.T_ab.inverse() * mine->edges.front().T_ab).log();
    const double sigmas = std::sqrt(mahalanobis_squared(xi, step.covariance) / 6);
    if (!std::isfinite(sigmas)) return {sigmas, sigmas, sigmas};
    max_difference.sigmas = std::max(max_difference.sigmas, sigmas);
    max_difference.metres = std::max(max_difference.metres, xi.head<3>().norm());
    max_difference.radians = std::max(max_difference.radians, xi.tail<3>().norm());
  }
  return max_difference;
}

}  // namespace relmap::map
