// A chain of edges, compounded to one transform with its covariance (docs/method.md, 3). Neighbouring odometry edges
// share landmarks, so their errors are correlated. The later one stores the correlation
// (Edge::correlation_with_previous); it is included here in whichever direction the edges are walked. Edges further
// apart are taken as independent.
#pragma once

#include <array>
#include <cstdint>

#include "storage/graph/frame.h"

namespace relmap::storage {

class CompoundedChain {
 public:
  // Appends a step along `edge`: from its a to its b if `forward`, otherwise from b to a.
  void append(const Edge& edge, bool forward);

  // T_first_last, of the frames where the chain begins and ends.
  const SE3& T() const { return T_; }
  // Covariance of xi in T Exp(xi); zero without edges.
  Matrix6 covariance() const;
  std::uint32_t edges() const { return edges_; }
  // Whether the correlations of all neighbouring edges in the chain are known and included in covariance().
  bool is_correlated() const;

 private:
  // The edge appended last: the step's error is J xi, where xi is the edge's own.
  struct Step {
    FrameId a, b;
    bool is_odometry = false;
    Matrix6 J = Matrix6::Zero(), covariance = Matrix6::Zero();
    std::array<std::int8_t, 36> correlation{};
  };
  static Matrix6 common(const Step& step, const Step& before);

  SE3 T_;
  Matrix6 correlated_ = Matrix6::Zero();
  Matrix6 independent_ = Matrix6::Zero();  // covariance with all edges taken as independent
  bool known_ = true;                      // the correlations of all neighbours so far
  std::uint32_t edges_ = 0;
  Step last_;
};

}  // namespace relmap::storage
