#include "storage/graph/compounded_chain.h"

#include <Eigen/Cholesky>

#include "storage/graph/precision.h"

namespace relmap::storage {

namespace {

bool is_positive(const Matrix6& covariance) {
  return covariance.allFinite() && covariance.llt().info() == Eigen::Success;
}

}  // namespace

// Cross-covariance of the error of `step` (rows) with that of the step before it in the chain; zero unless both are
// neighbouring odometry edges.
Matrix6 CompoundedChain::common(const Step& step, const Step& before) {
  Matrix6 common = Matrix6::Zero();
  if (step.is_odometry && before.is_odometry) {
    if (step.a == before.b) common = from_correlation(step.correlation, step.covariance, before.covariance);
    if (before.a == step.b)
      common = from_correlation(before.correlation, before.covariance, step.covariance).transpose();
  }
  return step.J * common * before.J.transpose();
}

void CompoundedChain::append(const Edge& edge, bool forward) {
  Step step;
  step.a = edge.a;
  step.b = edge.b;
  step.is_odometry = edge.id.ordinal == 0;
  step.J = forward ? Matrix6(Matrix6::Identity()) : Matrix6(-edge.T_ab.adjoint());
  step.covariance = edge.covariance;
  step.correlation = edge.correlation_with_previous;

  const SE3 T = forward ? edge.T_ab : edge.T_ab.inverse();
  const Matrix6 own = forward ? edge.covariance : inverse_covariance(edge.T_ab, edge.covariance);
  correlated_ = compound_covariance(correlated_, T, own);
  independent_ = compound_covariance(independent_, T, own);
  if (edges_ > 0) {
    const Matrix6 both = common(step, last_);
    const Matrix6 carried = both * T.inverse().adjoint().transpose();
    correlated_ += carried + carried.transpose();
    known_ = known_ && !both.isZero(0);
  }
  T_ = T_ * T;
  ++edges_;
  last_ = step;
}

// With the correlations of neighbours alone the sum may not be positive definite; then all edges are taken as
// independent.
Matrix6 CompoundedChain::covariance() const {
  const Matrix6& covariance = edges_ == 0 || is_positive(correlated_) ? correlated_ : independent_;
  return 0.5 * (covariance + covariance.transpose());
}

bool CompoundedChain::is_correlated() const { return known_ && (edges_ == 0 || is_positive(correlated_)); }

}  // namespace relmap::storage
