// A chain of edges as one transform with its covariance (docs/method.md, 3). Neighbouring odometry edges share
// landmarks, so their errors have something in common: as much is stored with the later one
// (Edge::correlation_with_previous), and counted here in whichever direction they are walked. Edges further apart are
// taken as independent.
#pragma once

#include <array>
#include <cstdint>

#include "storage/graph/frame.h"

namespace relmap::storage {

class CompoundedChain {
 public:
  // Walks on along `edge`, from its a to its b (forward) or back.
  void append(const Edge& edge, bool forward);

  // Of the frame where the chain begins and that where it has come to.
  const SE3& T() const { return T_; }
  // Of T Exp(xi); zero for no edges.
  Matrix6 covariance() const;
  std::uint32_t edges() const { return edges_; }
  // Of all neighbours in the chain it is known what they have in common, and that enters covariance().
  bool is_correlated() const;

 private:
  // The last edge: T_step Exp(J xi) of its own xi.
  struct Step {
    FrameId a, b;
    bool is_odometry = false;
    Matrix6 J = Matrix6::Zero(), covariance = Matrix6::Zero();
    std::array<std::int8_t, 36> correlation{};
  };
  static Matrix6 common(const Step& step, const Step& before);

  SE3 T_;
  Matrix6 correlated_ = Matrix6::Zero();
  Matrix6 independent_ = Matrix6::Zero();  // as if no two edges had anything in common
  bool known_ = true;                      // of all neighbours so far
  std::uint32_t edges_ = 0;
  Step last_;
};

}  // namespace relmap::storage
