#include "server/rba/normal_equations.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "server/rba/measurement.h"

namespace relmap::rba {

namespace {

constexpr double kDepthInformation = 1 / (kPriorInverseDepthSigma * kPriorInverseDepthSigma);

// X [q]x for q = (a, b, 1).
Matrix3 times_skew(const Matrix3& X, double a, double b) {
  Matrix3 result;
  result.col(0) = X.col(1) - b * X.col(2);
  result.col(1) = a * X.col(2) - X.col(0);
  result.col(2) = b * X.col(0) - a * X.col(1);
  return result;
}
// [q]x X.
Matrix3 skew_times(const Matrix3& X, double a, double b) {
  Matrix3 result;
  result.row(0) = b * X.row(2) - X.row(1);
  result.row(1) = X.row(0) - a * X.row(2);
  result.row(2) = a * X.row(1) - b * X.row(0);
  return result;
}

// Of row p and column q >= p in the upper triangle of n rows, row by row.
std::size_t in_triangle(std::int32_t n, std::int32_t p, std::int32_t q) {
  return static_cast<std::size_t>(p * n - p * (p + 1) / 2 + q);
}

// *M += E' P E, E = [ rho I | -[q]x ].
void add_levered(const Matrix3& P, const Vector3& abr, Matrix6* M) {
  const double a = abr.x(), b = abr.y(), rho = abr.z();
  const Matrix3 right = times_skew(P, a, b);
  M->topLeftCorner<3, 3>() += rho * rho * P;
  M->topRightCorner<3, 3>() -= rho * right;
  M->bottomLeftCorner<3, 3>() += rho * skew_times(P, a, b);
  M->bottomRightCorner<3, 3>() -= skew_times(right, a, b);
}

}  // namespace

void NormalEquations::reset(const Problem& problem) {
  group_of_node_.assign(problem.nodes.size(), -1);
  landmarks_.resize(problem.landmarks.size());
  groups_.clear();
  bases_.clear();
  for (const ProblemBase& base : problem.bases) {
    const auto first = static_cast<std::int32_t>(groups_.size());
    for (std::int32_t n = base.first_node; n < base.end_node; ++n) {
      const ProblemNode& node = problem.nodes[n];
      if (node.parent < 0) continue;
      const std::int32_t before = group_of_node_[node.parent];
      const std::int32_t column = problem.edges[node.edge].column;
      if (column < 0) {
        group_of_node_[n] = before;
        continue;
      }
      group_of_node_[n] = static_cast<std::int32_t>(groups_.size()) - first;
      groups_.push_back({column, before, n, Matrix6::Zero()});
    }
    bases_.push_back({first, static_cast<std::int32_t>(groups_.size())});
  }
  if (problem.columns <= ReducedSystem::kMostDense) return system_.reset(problem.columns);
  std::vector<std::pair<std::int32_t, std::int32_t>> pattern;
  for (std::size_t k = 0; k < bases_.size(); ++k) {
    if (problem.bases[k].first_landmark == problem.bases[k].end_free) continue;
    for (std::int32_t p = bases_[k].first; p < bases_[k].end; ++p)
      for (std::int32_t q = p + 1; q < bases_[k].end; ++q)
        pattern.push_back(std::minmax(groups_[p].column, groups_[q].column, std::greater<>()));
  }
  system_.reset(problem.columns, pattern);
}

bool NormalEquations::assemble(const Problem& problem, const std::vector<SE3>& poses, double huber, double lambda) {
  system_.clear();
  slots_.clear();
  observations_ = 0;
  for (std::size_t k = 0; k < problem.bases.size(); ++k) {
    const ProblemBase& base = problem.bases[k];
    if (base.first_landmark == base.end_free) continue;
    const BaseGroups& own = bases_[k];
    const std::int32_t groups = own.end - own.first;
    M_.assign(static_cast<std::size_t>(groups) * (groups + 1) / 2, Matrix6::Zero());
    m_.assign(groups, Vector6::Zero());
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l)
      if (!eliminate(problem, poses, l, huber, lambda, groups)) return false;
    for (std::int32_t g = own.first; g < own.end; ++g) {
      const ProblemNode& node = problem.nodes[groups_[g].node];
      groups_[g].S = edge_to_theta(node.forward, poses[node.parent].inverse(), poses[groups_[g].node].inverse());
    }
    sum_over_descendants(own);
    add_to_system(own);
  }
  add_priors(problem);
  return true;
}

bool NormalEquations::eliminate(const Problem& problem, const std::vector<SE3>& poses, std::int32_t landmark,
                                double huber, double lambda, std::int32_t groups) {
  const ProblemLandmark& point = problem.landmarks[landmark];
  LandmarkBlock& block = landmarks_[landmark];
  block.first_slot = static_cast<std::int32_t>(slots_.size());
  Matrix3 V = Matrix3::Zero();
  block.r.setZero();
  if (point.depth_prior) {
    V(2, 2) = kDepthInformation;
    block.r.z() = kDepthInformation * (kPriorInverseDepth - point.abr.z());
  }
  for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
    const ProblemObservation& observation = problem.observations[o];
    if (!observation.counted) continue;
    ++observations_;
    const StereoCamera& camera = problem.cameras[observation.camera];
    const SE3& T_ij = poses[observation.node];
    const Vector3 s = scaled_point(T_ij, point.abr);
    StereoPixel h;
    if (!predict(camera, s, point.abr.z(), &h)) return false;
    const Vector3 r = residual(observation.z, observation.mono, h);
    const double w =
        observation.information * huber_weight(std::sqrt(observation.information * r.squaredNorm()), huber);
    const MeasurementJacobian j = measurement_jacobian(camera, T_ij, s, point.abr.z(), observation.mono);
    const Matrix3 wH = w * j.d_landmark;
    V.noalias() += wH.transpose() * j.d_landmark;
    block.r.noalias() += wH.transpose() * r;
    const std::int32_t group = group_of_node_[observation.node];
    if (group < 0) continue;
    std::size_t at = block.first_slot;
    while (at < slots_.size() && slots_[at].group != group) ++at;
    if (at == slots_.size()) slots_.push_back({group, Matrix3::Zero(), Matrix3::Zero(), Vector3::Zero()});
    Slot& slot = slots_[at];
    slot.C.noalias() += wH.transpose() * j.G;
    slot.N.noalias() += w * (j.G.transpose() * j.G);
    slot.g.noalias() += w * (j.G.transpose() * r);
  }
  block.end_slot = static_cast<std::int32_t>(slots_.size());
  V.diagonal() *= 1 + lambda;
  const double determinant = V.determinant();
  // Against the largest it could be: the product of the diagonal (Hadamard).
  if (!(determinant > 1e-14 * V.diagonal().prod())) return false;
  block.V_inverse = V.inverse();

  const Matrix36 E = lever(point.abr);
  for (std::int32_t i = block.first_slot; i < block.end_slot; ++i) {
    const Slot& slot = slots_[i];
    const Matrix3 K = slot.C.transpose() * block.V_inverse;
    m_[slot.group].noalias() += E.transpose() * (slot.g - K * block.r);
    add_levered(slot.N - K * slot.C, point.abr, &M_[in_triangle(groups, slot.group, slot.group)]);
    for (std::int32_t k = i + 1; k < block.end_slot; ++k) {
      const Slot& other = slots_[k];
      const Matrix3 P = -K * other.C;
      if (slot.group < other.group)
        add_levered(P, point.abr, &M_[in_triangle(groups, slot.group, other.group)]);
      else
        add_levered(P.transpose(), point.abr, &M_[in_triangle(groups, other.group, slot.group)]);
    }
  }
  return true;
}

void NormalEquations::sum_over_descendants(const BaseGroups& base) {
  // Children after parents, so that from the back each row is complete when it is added to its parent's. Each step is
  // the congruence M <- L M L' with L = I + e_p e_g', on the upper triangle of a symmetric M.
  const std::int32_t n = base.end - base.first;
  const auto M = [&](std::int32_t p, std::int32_t q) -> Matrix6& { return M_[in_triangle(n, p, q)]; };
  for (std::int32_t g = n - 1; g > 0; --g) {
    const std::int32_t p = groups_[base.first + g].parent;
    if (p < 0) continue;
    m_[p] += m_[g];
    M(p, p) += M(p, g) + M(p, g).transpose() + M(g, g);
    for (std::int32_t k = 0; k < p; ++k) M(k, p) += M(k, g);
    for (std::int32_t k = p + 1; k < g; ++k) M(p, k) += M(k, g).transpose();
    for (std::int32_t k = g; k < n; ++k) M(p, k) += M(g, k);
  }
}

void NormalEquations::add_to_system(const BaseGroups& base) {
  const std::int32_t n = base.end - base.first;
  for (std::int32_t p = 0; p < n; ++p) {
    const Group& row = groups_[base.first + p];
    const Matrix6 S_transposed = row.S.transpose();
    system_.right_side(row.column).noalias() += S_transposed * m_[p];
    for (std::int32_t q = p; q < n; ++q) {
      const Group& column = groups_[base.first + q];
      const Matrix6 left = S_transposed * M_[in_triangle(n, p, q)];
      if (row.column >= column.column)
        system_.block(row.column, column.column).noalias() += left * column.S;
      else
        system_.block(column.column, row.column).noalias() += (left * column.S).transpose();
    }
  }
}

void NormalEquations::add_priors(const Problem& problem) {
  for (const ProblemEdge& edge : problem.edges) {
    if (edge.column < 0 || !edge.prior) continue;
    const Vector6 r = (edge.prior_T_ab.inverse() * edge.T_ab).log();
    const Matrix6 J = right_jacobian_inverse(r);
    const Matrix6 JW = J.transpose() * edge.prior_information;
    system_.block(edge.column, edge.column).noalias() += JW * J;
    system_.right_side(edge.column).noalias() -= JW * r;
  }
}

void NormalEquations::back_substitute(const Problem& problem, const std::vector<Vector6>& dxi,
                                      std::vector<Vector3>* dl) {
  dl->assign(problem.landmarks.size(), Vector3::Zero());
  for (std::size_t k = 0; k < problem.bases.size(); ++k) {
    const ProblemBase& base = problem.bases[k];
    if (base.first_landmark == base.end_free) continue;
    const BaseGroups& own = bases_[k];
    theta_.resize(own.end - own.first);
    for (std::int32_t g = 0; g < own.end - own.first; ++g) {
      const Group& group = groups_[own.first + g];
      theta_[g].noalias() = group.S * dxi[group.column];
      if (group.parent >= 0) theta_[g] += theta_[group.parent];
    }
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l) {
      const LandmarkBlock& block = landmarks_[l];
      const Matrix36 E = lever(problem.landmarks[l].abr);
      Vector3 r = block.r;
      for (std::int32_t i = block.first_slot; i < block.end_slot; ++i)
        r.noalias() -= slots_[i].C * (E * theta_[slots_[i].group]);
      (*dl)[l].noalias() = block.V_inverse * r;
    }
  }
}

double true_cost(const Problem& problem, const std::vector<SE3>& poses, double huber) {
  double cost = 0;
  for (const ProblemBase& base : problem.bases) {
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l) {
      const ProblemLandmark& point = problem.landmarks[l];
      if (point.depth_prior) cost += kDepthInformation * std::pow(point.abr.z() - kPriorInverseDepth, 2);
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
        const ProblemObservation& observation = problem.observations[o];
        if (!observation.counted) continue;
        StereoPixel h;
        if (!predict(problem.cameras[observation.camera], scaled_point(poses[observation.node], point.abr),
                     point.abr.z(), &h))
          return std::numeric_limits<double>::infinity();
        const double squared = residual(observation.z, observation.mono, h).squaredNorm();
        cost += huber_loss(std::sqrt(observation.information * squared), huber);
      }
    }
  }
  for (const ProblemEdge& edge : problem.edges) {
    if (edge.column < 0 || !edge.prior) continue;
    const Vector6 r = (edge.prior_T_ab.inverse() * edge.T_ab).log();
    cost += r.dot(edge.prior_information * r);
  }
  return cost;
}

}  // namespace relmap::rba
