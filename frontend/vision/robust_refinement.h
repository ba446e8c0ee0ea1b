// Levenberg-Marquardt on Huber's cost over correspondences whose covariances are fixed at the beginning: if they went
// with the state, a state that sees everything uncertainly would cost the least. Internal to frontend/vision.
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

// One correspondence at a state with N parameters: what was measured less what is predicted, its derivative by the
// state's perturbation, and its covariance. Of a row that is not used all is zero, and the covariance one.
template <int N>
struct CorrespondenceResidual {
  int rows = 0;  // 2 or 3; 0: nothing is predicted (the point is behind the camera)
  Vector3 value = Vector3::Zero();
  Eigen::Matrix<double, 3, N> jacobian;
  Matrix3 covariance;
};

// Finite, and with a sigma.
inline bool usable(const Correspondence& c) {
  return c.point.allFinite() && std::isfinite(c.pixel.x()) && std::isfinite(c.pixel.y()) && !std::isinf(c.pixel.z()) &&
         std::isfinite(c.sigma) && c.sigma > 0 && c.point_covariance.allFinite();
}

// Each coordinate is within so many sigmas of its prediction. `max_sigma`, pixels: a point that might appear so far
// off agrees with any pose, and one just before the eye has a covariance that has no inverse.
template <int N>
bool agrees(const CorrespondenceResidual<N>& r, double gate_sigmas, double max_sigma) {
  const double g2 = gate_sigmas * gate_sigmas;
  for (int k = 0; k < r.rows; ++k)
    if (!(r.value[k] * r.value[k] <= g2 * r.covariance(k, k) && r.covariance(k, k) <= max_sigma * max_sigma))
      return false;
  return r.rows > 0;
}

namespace huber {

inline constexpr double kThreshold = 1.5;  // of the Mahalanobis norm divided by the root of its dimension

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
  Information information = Information::Zero();  // the prior's included
  double weighted_squares = 0;                    // of the whitened residuals
  int rows = 0;

  // Mean square of the residuals over what their sigmas promise.
  double variance_factor() const { return weighted_squares / std::max(1, rows - Model::kParameters); }
  // Of the perturbation. Where the residuals are larger than their sigmas promise, so is the uncertainty.
  Information covariance() const {
    const Eigen::LDLT<Information> factor(information);
    const Information inverse = std::max(1.0, variance_factor()) * factor.solve(Information::Identity());
    return 0.5 * (inverse + inverse.transpose());
  }
};

// A Model has: State; kParameters; size(), how many correspondences; at(state), which gives for (k, with_jacobian) the
// k-th one's residual; plus(state, perturbation); settle(state), which takes rounding out of it; prior_cost(state) and
// add_prior(state, A, b), which adds the prior's information and gradient. Nothing: where a point comes to lie behind
// the camera, or the equations have no solution.
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
        state = model.settle(candidate);
        cost = candidate_cost;
        lambda = std::max(1e-9, lambda * 0.1);
        moved = true;
        if (converged) iteration = iterations - 1;
      } else {
        lambda = std::max(1e-4, lambda * 10);
      }
    }
    if (!moved) iteration = iterations - 1;  // as good as it gets: once more for the information
  }
  return result;
}

}  // namespace relmap::vision
