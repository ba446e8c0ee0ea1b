// Levenberg-Marquardt on Huber's cost over correspondences. Their covariances are computed once, at the initial state:
// if they followed the state, a state at which everything is uncertain would have the lowest cost. Internal to
// frontend/vision.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "frontend/vision/motion.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

// One correspondence at a state with N parameters: measurement minus prediction, its derivative by the perturbation of
// the state, and its covariance. An unused row is zero, with a variance of one.
template <int N>
struct CorrespondenceResidual {
  int rows = 0;  // 2 or 3; 0 if there is no prediction (the point is behind the camera)
  Vector3 value = Vector3::Zero();
  Eigen::Matrix<double, 3, N> jacobian;
  Matrix3 covariance;
};

// All values are finite (a right pixel may be NaN, for mono), and sigma is positive.
inline bool usable(const Correspondence& c) {
  return c.point.allFinite() && std::isfinite(c.pixel.x()) && std::isfinite(c.pixel.y()) && !std::isinf(c.pixel.z()) &&
         std::isfinite(c.sigma) && c.sigma > 0 && c.point_covariance.allFinite() && c.seen_from.allFinite();
}

// Each coordinate is within `gate_sigmas` of its prediction, and its sigma is at most `max_sigma` pixels: a point with
// a larger one agrees with any pose, and the covariance of a point just before the eye has no inverse.
template <int N>
bool agrees(const CorrespondenceResidual<N>& r, double gate_sigmas, double max_sigma) {
  const double g2 = gate_sigmas * gate_sigmas;
  for (int k = 0; k < r.rows; ++k)
    if (!(r.value[k] * r.value[k] <= g2 * r.covariance(k, k) && r.covariance(k, k) <= max_sigma * max_sigma))
      return false;
  return r.rows > 0;
}

namespace huber {

inline constexpr double kThreshold = 1.5;  // for the Mahalanobis norm divided by the square root of its dimension

inline double weight(double squared, int rows) {
  const double norm = std::sqrt(squared / rows);
  return norm <= kThreshold ? 1 : kThreshold / norm;
}
inline double cost(double squared, int rows) {
  const double norm = std::sqrt(squared / rows);
  return rows * (norm <= kThreshold ? norm * norm : 2 * kThreshold * norm - kThreshold * kThreshold);
}

}  // namespace huber

template <typename Model>
struct Refined {
  using Information = Eigen::Matrix<double, Model::kParameters, Model::kParameters>;

  typename Model::State state;
  Information information = Information::Zero();  // includes the prior's
  double weighted_squares = 0;                    // sum of the weighted squares of the whitened residuals
  int rows = 0;

  // Variance of unit weight: about 1 if the residuals are as large as their sigmas say.
  double variance_factor() const { return weighted_squares / std::max(1, rows - Model::kParameters); }
  // Covariance of the perturbation, scaled by variance_factor() if that is above 1.
  Information covariance() const {
    const Eigen::LDLT<Information> factor(information);
    const Information inverse = std::max(1.0, variance_factor()) * factor.solve(Information::Identity());
    return 0.5 * (inverse + inverse.transpose());
  }
};

// Refines `state` in at most `iterations` steps. Nothing if a point lies behind the camera at the initial state, or if
// the normal equations have no solution.
//
// A Model has: State; kParameters; size(), the number of correspondences; at(state), which returns a function from
// (k, with_jacobian) to the residual of correspondence k; plus(state, perturbation); normalized(state), which removes
// rounding errors; prior_cost(state); and add_prior(state, A, b), which adds the prior's information and gradient.
template <typename Model>
std::optional<Refined<Model>> refine(const Model& model, typename Model::State state, int iterations) {
  using Information = typename Refined<Model>::Information;
  using Perturbation = Eigen::Matrix<double, Model::kParameters, 1>;
  std::vector<Matrix3> information;
  {
    const auto residual = model.at(state);
    for (std::size_t k = 0; k < model.size(); ++k) information.push_back(residual(k, false).covariance.inverse());
  }
  const auto cost_at = [&](const typename Model::State& at) {
    const auto residual = model.at(at);
    double cost = model.prior_cost(at);
    for (std::size_t k = 0; k < model.size(); ++k) {
      const auto r = residual(k, false);
      if (r.rows == 0) return std::numeric_limits<double>::infinity();
      cost += huber::cost(r.value.dot(information[k] * r.value), r.rows);
    }
    return cost;
  };
  Refined<Model> result{state};
  double lambda = 1e-6;
  double cost = cost_at(state);
  if (!std::isfinite(cost)) return std::nullopt;
  for (int iteration = 0; iteration <= iterations; ++iteration) {
    const auto residual = model.at(state);
    Information A = Information::Zero();
    Perturbation b = Perturbation::Zero();
    result.weighted_squares = 0;
    result.rows = 0;
    for (std::size_t k = 0; k < model.size(); ++k) {
      const auto r = residual(k, true);
      const double squared = r.value.dot(information[k] * r.value);
      const double w = huber::weight(squared, r.rows);
      const Eigen::Matrix<double, Model::kParameters, 3> JtW = w * r.jacobian.transpose() * information[k];
      A += JtW * r.jacobian;
      b += JtW * r.value;
      result.weighted_squares += w * squared;
      result.rows += r.rows;
    }
    model.add_prior(state, A, b);
    result.state = state;
    result.information = A;
    if (iteration == iterations) break;
    bool moved = false;
    for (int attempt = 0; attempt < 6 && !moved; ++attempt) {
      Information damped = A;
      damped.diagonal() += lambda * A.diagonal();
      // value(xi) = value + J xi
      const Perturbation xi = -damped.ldlt().solve(b);
      if (!xi.allFinite()) return std::nullopt;
      const typename Model::State candidate = model.plus(state, xi);
      const double candidate_cost = cost_at(candidate);
      if (candidate_cost <= cost) {
        const bool converged = xi.norm() < 1e-7;
        state = model.normalized(candidate);
        cost = candidate_cost;
        lambda = std::max(1e-9, lambda * 0.1);
        moved = true;
        if (converged) iteration = iterations - 1;
      } else {
        lambda = std::max(1e-4, lambda * 10);
      }
    }
    if (!moved) iteration = iterations - 1;  // no step helps: linearise once more for the information
  }
  return result;
}

}  // namespace relmap::vision
