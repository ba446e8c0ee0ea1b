#include "server/rba/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>

#include "server/rba/measurement.h"
#include "server/rba/normal_equations.h"
#include "server/rba/reduced_system.h"

namespace relmap::rba {

namespace {

constexpr double kFirstLambda = 1e-6;
constexpr double kLeastLambda = 1e-9;
constexpr double kMostLambda = 1e6;
constexpr double kCovarianceLambda = 1e-5;  // above it the last system is no longer that of the solution

// The problem's variables, to be undone.
struct State {
  std::vector<SE3> edges;
  std::vector<Vector3> landmarks;

  void save(const Problem& problem) {
    edges.clear();
    landmarks.clear();
    for (const ProblemEdge& edge : problem.edges) edges.push_back(edge.T_ab);
    for (const ProblemLandmark& landmark : problem.landmarks) landmarks.push_back(landmark.abr);
  }
  void restore(Problem* problem) const {
    for (std::size_t k = 0; k < edges.size(); ++k) problem->edges[k].T_ab = edges[k];
    for (std::size_t k = 0; k < landmarks.size(); ++k) problem->landmarks[k].abr = landmarks[k];
  }
};

void take_step(const Eigen::VectorXd& dxi, const std::vector<Vector3>& dl, Problem* problem) {
  for (ProblemEdge& edge : problem->edges)
    if (edge.column >= 0) edge.T_ab = (edge.T_ab * SE3::exp(dxi.segment<6>(6 * edge.column))).normalized();
  for (const ProblemBase& base : problem->bases)
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l) {
      Vector3& abr = problem->landmarks[l].abr;
      abr += dl[l];
      abr.z() = std::max(abr.z(), kMinInverseDepth);
    }
}

void take_covariances(const ReducedSystem& system, double factor, CovarianceRequest* request) {
  for (std::size_t c = 0; c < request->wanted.size(); ++c) {
    if (!request->wanted[c]) continue;
    const Eigen::MatrixXd columns = factor * system.inverse_columns(static_cast<Eigen::Index>(c));
    if (!columns.allFinite()) continue;
    const Matrix6 own = columns.middleRows<6>(static_cast<Eigen::Index>(6 * c));
    request->covariances[c] = 0.5 * (own + own.transpose());
    const std::int32_t previous = request->previous[c];
    if (previous >= 0) request->with_previous[c] = columns.middleRows<6>(6 * previous).transpose();
  }
}

}  // namespace

SolverReport solve(Problem* problem, const SolverOptions& options, CovarianceRequest* covariance) {
  SolverReport report;
  std::vector<SE3> poses;
  problem->compose(&poses);
  double cost = true_cost(*problem, poses, options.huber);
  report.cost_before = report.cost_after = cost;
  if (!std::isfinite(cost)) {
    report.failed = true;
    return report;
  }
  NormalEquations equations(*problem);
  State start, before;
  start.save(*problem);
  double lambda = kFirstLambda;
  std::vector<Vector3> dl;
  ReducedSystem system;
  bool solved = false;                 // some system could be solved
  double factored_with = kMostLambda;  // what `system` was damped with; that much if it is of no use
  while (report.iterations < options.max_iterations) {
    ++report.iterations;
    factored_with = kMostLambda;
    bool usable = equations.assemble(*problem, poses, options.huber, lambda);
    report.work += equations.observations();
    Eigen::VectorXd dxi;
    if (usable) {
      usable = system.factor(equations.A(), lambda);
      if (usable) factored_with = lambda;
    }
    if (usable) {
      dxi = system.solve(equations.b());
      equations.back_substitute(*problem, dxi, &dl);
      usable = dxi.allFinite();
    }
    double gained = 0;
    if (usable) {
      solved = true;
      before.save(*problem);
      take_step(dxi, dl, problem);
      problem->compose(&poses);
      const double after = true_cost(*problem, poses, options.huber);
      if (after <= cost) {  // false for NaN
        gained = cost - after;
        ++report.accepted;
        cost = after;
        lambda = std::max(lambda / 10, kLeastLambda);
        if (gained <= options.relative_decrease * cost) break;
        continue;
      }
      before.restore(problem);
      problem->compose(&poses);
      // No descent left to find: the step is as small as the arithmetic.
      if (after - cost <= 1e-9 * cost) break;
    }
    lambda *= 100;
    if (lambda > kMostLambda) break;
  }
  if (!solved) {
    start.restore(problem);
    report.failed = true;
    return report;
  }
  report.cost_after = cost;
  if (covariance == nullptr) return report;
  covariance->covariances.assign(covariance->wanted.size(), Matrix6::Zero());
  covariance->with_previous = covariance->covariances;
  if (std::find(covariance->wanted.begin(), covariance->wanted.end(), true) == covariance->wanted.end()) return report;
  if (factored_with > kCovarianceLambda) {
    report.work += equations.observations();
    if (!equations.assemble(*problem, poses, options.huber, 0) || !system.factor(equations.A(), 0)) return report;
  }
  take_covariances(system, huber_covariance_factor(options.huber), covariance);
  return report;
}

}  // namespace relmap::rba
