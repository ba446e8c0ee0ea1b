#include "server/rba/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>

#include "server/rba/measurement.h"

namespace relmap::rba {

namespace {

constexpr double kFirstLambda = 1e-6;
constexpr double kMinLambda = 1e-9;
constexpr double kMaxLambda = 1e6;
constexpr double kCovarianceLambda = 1e-5;  // a system with more damping is factored anew for the covariances

void take_step(const std::vector<Vector6>& dxi, const std::vector<Vector3>& dl, Problem* problem) {
  for (ProblemEdge& edge : problem->edges)
    if (edge.column >= 0) edge.T_ab = (edge.T_ab * SE3::exp(dxi[edge.column])).normalized();
  for (const ProblemBase& base : problem->bases)
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l) {
      Vector3& abr = problem->landmarks[l].abr;
      abr += dl[l];
      abr.z() = std::max(abr.z(), kMinInverseDepth);
    }
}

}  // namespace

void LevenbergMarquardt::State::save(const Problem& problem) {
  edges.clear();
  landmarks.clear();
  for (const ProblemEdge& edge : problem.edges) edges.push_back(edge.T_ab);
  for (const ProblemLandmark& landmark : problem.landmarks) landmarks.push_back(landmark.abr);
}

void LevenbergMarquardt::State::restore(Problem* problem) const {
  for (std::size_t k = 0; k < edges.size(); ++k) problem->edges[k].T_ab = edges[k];
  for (std::size_t k = 0; k < landmarks.size(); ++k) problem->landmarks[k].abr = landmarks[k];
}

void LevenbergMarquardt::take_covariances(double factor, CovarianceRequest* request) {
  for (std::size_t c = 0; c < request->wanted.size(); ++c) {
    if (!request->wanted[c]) continue;
    equations_.system().inverse_column(static_cast<std::int32_t>(c), &column_);
    const Matrix6 own = factor * column_[c];
    const std::int32_t previous = request->previous[c];
    const Matrix6 cross = previous >= 0 ? Matrix6(factor * column_[previous].transpose()) : Matrix6(Matrix6::Zero());
    if (!own.allFinite() || !cross.allFinite()) continue;
    request->covariances[c] = 0.5 * (own + own.transpose());
    request->with_previous[c] = cross;
  }
}

SolverReport LevenbergMarquardt::solve(Problem* problem, const SolverOptions& options, CovarianceRequest* covariance) {
  SolverReport report;
  problem->compose(&poses_);
  double cost = true_cost(*problem, poses_, options.huber);
  report.cost_before = report.cost_after = cost;
  if (!std::isfinite(cost)) {
    report.failed = true;
    return report;
  }
  equations_.reset(*problem);
  ReducedSystem& system = equations_.system();
  start_.save(*problem);
  double lambda = kFirstLambda;
  bool solved = false;                // at least one system could be solved
  double factored_with = kMaxLambda;  // damping of the factored `system`; kMaxLambda if it is not factored
  while (report.iterations < options.max_iterations) {
    ++report.iterations;
    factored_with = kMaxLambda;
    bool usable = equations_.assemble(*problem, poses_, options.huber, lambda);
    report.work += equations_.observations();
    if (usable) {
      usable = system.factor(lambda);
      if (usable) factored_with = lambda;
    }
    if (usable) {
      system.solve(&dxi_);
      equations_.back_substitute(*problem, dxi_, &dl_);
      usable = std::all_of(dxi_.begin(), dxi_.end(), [](const Vector6& step) { return step.allFinite(); });
    }
    double gained = 0;
    if (usable) {
      solved = true;
      before_.save(*problem);
      take_step(dxi_, dl_, problem);
      problem->compose(&poses_);
      const double after = true_cost(*problem, poses_, options.huber);
      if (after <= cost) {  // false for NaN
        gained = cost - after;
        ++report.accepted;
        cost = after;
        lambda = std::max(lambda / 10, kMinLambda);
        if (gained <= options.relative_decrease * cost) break;
        continue;
      }
      before_.restore(problem);
      problem->compose(&poses_);
      // Converged: the cost rose by no more than rounding.
      if (after - cost <= 1e-9 * cost) break;
    }
    lambda *= 100;
    if (lambda > kMaxLambda) break;
  }
  if (!solved) {
    start_.restore(problem);
    problem->compose(&poses_);
    report.failed = true;
    return report;
  }
  report.cost_after = cost;
  if (covariance == nullptr) return report;
  covariance->covariances.assign(covariance->wanted.size(), Matrix6::Zero());
  covariance->with_previous.assign(covariance->wanted.size(), Matrix6::Zero());
  if (std::find(covariance->wanted.begin(), covariance->wanted.end(), 1) == covariance->wanted.end()) return report;
  if (factored_with > kCovarianceLambda) {
    report.work += equations_.observations();
    if (!equations_.assemble(*problem, poses_, options.huber, 0) || !system.factor(0)) return report;
  }
  take_covariances(huber_covariance_factor(options.huber), covariance);
  return report;
}

}  // namespace relmap::rba
