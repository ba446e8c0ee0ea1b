// What an edge costs to travel (docs/method.md, 8).
#pragma once

#include "storage/graph/frame.h"

namespace relmap::route {

// The costs of an edge, each of which adds up along a route.
struct EdgeCosts {
  double metres = 0;       // |t| of the edge
  double driven_s = 0;     // for a loop edge, the value that was set when it was accepted
  double standing_s = 0;   // 0 for a loop edge
  double variance_m2 = 0;  // trace of the covariance of its translation

  bool operator==(const EdgeCosts&) const = default;
};

inline double length_m(const storage::Edge& edge) { return edge.T_ab.t.norm(); }

inline double standing_s(const storage::Edge& edge) {
  return edge.kind == storage::EdgeKind::kLoop ? 0.0 : double{edge.standing_s};
}
inline double variance_m2(const storage::Edge& edge) { return edge.covariance.diagonal().head<3>().sum(); }

inline EdgeCosts costs(const storage::Edge& edge) {
  return {length_m(edge), double{edge.driven_s}, standing_s(edge), variance_m2(edge)};
}

// Seconds; with `standing`, those of standing, too.
inline double time_s(const storage::Edge& edge, bool standing) {
  return edge.driven_s + (standing ? standing_s(edge) : 0.0);
}

// The weights of the costs. A route's cost is the weighted sum over its edges, which a search minimises.
struct RouteWeights {
  double metre = 1, driven_second = 0, standing_second = 0, square_metre_of_variance = 0;

  double operator()(const EdgeCosts& edge) const {
    return metre * edge.metres + driven_second * edge.driven_s + standing_second * edge.standing_s +
           square_metre_of_variance * edge.variance_m2;
  }
  // The same, without computing costs that have no weight.
  double operator()(const storage::Edge& edge) const {
    return (*this)(EdgeCosts{length_m(edge), double{edge.driven_s}, relmap::route::standing_s(edge),
                             square_metre_of_variance > 0 ? relmap::route::variance_m2(edge) : 0});
  }
  // A weight is 0 or within [kMin, kMax], so that no cost overflows or vanishes beside another; not all are 0.
  static constexpr double kMin = 1e-9, kMax = 1e9;
  bool valid() const {
    bool counts = false;
    for (const double weight : {metre, driven_second, standing_second, square_metre_of_variance}) {
      if (weight != 0 && !(weight >= kMin && weight <= kMax)) return false;
      counts |= weight != 0;
    }
    return counts;
  }
  bool operator==(const RouteWeights&) const = default;
};

inline constexpr RouteWeights kByDistance{};
inline constexpr RouteWeights kByTime{0, 1, 0, 0};
inline constexpr RouteWeights kByTimeStandingToo{0, 1, 1, 0};
inline constexpr RouteWeights kByCertainty{0, 0, 0, 1};

// Loop edges longer than this are flagged: that both ends saw the same things does not prove that a robot can drive
// from one to the other (Sibley et al. 2010, 5).
inline constexpr double kLongLoopMetres = 5.0;
inline bool is_long_loop(const storage::Edge& edge) {
  return edge.kind == storage::EdgeKind::kLoop && length_m(edge) > kLongLoopMetres;
}

}  // namespace relmap::route
