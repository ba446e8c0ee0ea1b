#include "server/rba/normal_equations.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "proto/linear/huber.h"
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

// Index of row p and column q >= p in the upper triangle of n rows, stored row by row.
std::size_t in_triangle(std::int32_t n, std::int32_t p, std::int32_t q) {
  return static_cast<std::size_t>(p * n - p * (p + 1) / 2 + q);
}

// *M += E' P E, E = [ rho I | -[q]x ], P symmetric.
void add_levered(const Matrix3& P, const Vector3& abr, Matrix6* M) {
  const double a = abr.x(), b = abr.y(), rho = abr.z();
  const Matrix3 right = times_skew(P, a, b);
  M->topLeftCorner<3, 3>() += rho * rho * P;
  M->topRightCorner<3, 3>() -= rho * right;
  M->bottomLeftCorner<3, 3>() -= rho * right.transpose();
  M->bottomRightCorner<3, 3>() -= skew_times(right, a, b);
}

// *M -= X Y', column by column.
void subtract_outer(const Matrix63& X, const Matrix63& Y, Matrix6* M) {
  for (Eigen::Index k = 0; k < 6; ++k) M->col(k) -= Y(k, 0) * X.col(0) + Y(k, 1) * X.col(1) + Y(k, 2) * X.col(2);
}

// Computes L^-1 of V = L L' from V's lower triangle. False if V is not positive definite.
bool invert_cholesky(const Matrix3& V, Matrix3* L_inverse) {
  const double l00 = std::sqrt(V(0, 0));
  const double l10 = V(1, 0) / l00, l20 = V(2, 0) / l00;
  const double l11 = std::sqrt(V(1, 1) - l10 * l10);
  const double l21 = (V(2, 1) - l20 * l10) / l11;
  const double pivot = V(2, 2) - l20 * l20 - l21 * l21;
  const double l22 = std::sqrt(pivot);
  // Compares the determinant with its upper bound, the product of the diagonal (Hadamard). False for NaN.
  if (!(l00 * l00 * l11 * l11 * pivot > 1e-14 * V.diagonal().prod())) return false;
  const double i00 = 1 / l00, i11 = 1 / l11, i22 = 1 / l22;
  *L_inverse << i00, 0, 0,       //
      -l10 * i00 * i11, i11, 0,  //
      (l10 * l21 * i11 - l20) * i00 * i22, -l21 * i11 * i22, i22;
  return true;
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
  if (problem.columns <= ReducedSystem::kMaxDense) return system_.reset(problem.columns);
  std::vector<std::pair<std::int32_t, std::int32_t>> pattern;
  for (std::size_t k = 0; k < bases_.size(); ++k) {
    if (problem.bases[k].first_landmark == problem.bases[k].end_landmark) continue;
    for (std::int32_t p = bases_[k].first; p < bases_[k].end; ++p)
      for (std::int32_t q = p + 1; q < bases_[k].end; ++q)
        if (groups_[p].column != groups_[q].column)
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
    const BaseGroups& own = bases_[k];
    const std::int32_t groups = own.end - own.first;
    if (base.first_landmark == base.end_landmark || (base.first_landmark == base.end_free && groups == 0)) continue;
    M_.assign(static_cast<std::size_t>(groups) * (groups + 1) / 2, Matrix6::Zero());
    m_.assign(groups, Vector6::Zero());
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l)
      if (!eliminate(problem, poses, l, huber, lambda, groups)) return false;
    for (std::int32_t l = base.end_free; l < base.end_landmark; ++l)
      if (!add_held(problem, poses, l, huber, groups)) return false;
    for (std::int32_t g = own.first; g < own.end; ++g) {
      const ProblemNode& node = problem.nodes[groups_[g].node];
      groups_[g].S = edge_to_theta(node.forward, poses[node.parent].inverse(), poses[groups_[g].node].inverse());
    }
    sum_over_descendants(own);
    add_to_system(own);
  }
  add_priors(problem, huber);
  return true;
}

bool NormalEquations::sum_measurements(const Problem& problem, const std::vector<SE3>& poses,
                                       const ProblemLandmark& point, double huber, double* v, double* r2) {
  const double rho = point.abr.z();
  sums_.assign(1, {-1, Matrix3::Zero(), Vector3::Zero(), Vector3::Zero()});
  for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
    const ProblemObservation& observation = problem.observations[o];
    if (!observation.counted) continue;
    ++observations_;
    const StereoCamera& camera = problem.cameras[observation.camera];
    const SE3& T_ij = poses[observation.node];
    const Vector3 s = scaled_point(T_ij, point.abr);
    StereoPixel predicted;
    if (!predict(camera, s, rho, &predicted)) return false;
    const Vector3 r = residual(observation.z, observation.mono, predicted);
    const double w =
        observation.information * huber_weight(std::sqrt(observation.information * r.squaredNorm()), huber);
    const MeasurementJacobian j = measurement_jacobian(camera, T_ij, s, rho, observation.mono);
    const Vector3 h = j.d_landmark.col(2);
    const std::int32_t group = group_of_node_[observation.node];
    std::size_t at = 0;
    while (at < sums_.size() && sums_[at].group != group) ++at;
    if (at == sums_.size()) sums_.push_back({group, Matrix3::Zero(), Vector3::Zero(), Vector3::Zero()});
    Sums& sums = sums_[at];
    for (Eigen::Index column = 0; column < 3; ++column) {
      const Vector3 wG = w * j.G.col(column);
      for (Eigen::Index row = column; row < 3; ++row) sums.N(row, column) += wG.dot(j.G.col(row));
      sums.c[column] += wG.dot(h);
      sums.g[column] += wG.dot(r);
    }
    *v += w * h.squaredNorm();
    *r2 += w * h.dot(r);
  }
  for (Sums& sums : sums_) {
    sums.N(0, 1) = sums.N(1, 0);
    sums.N(0, 2) = sums.N(2, 0);
    sums.N(1, 2) = sums.N(2, 1);
  }
  return true;
}

bool NormalEquations::add_held(const Problem& problem, const std::vector<SE3>& poses, std::int32_t landmark,
                               double huber, std::int32_t groups) {
  const ProblemLandmark& point = problem.landmarks[landmark];
  double v = 0, r2 = 0;
  if (!sum_measurements(problem, poses, point, huber, &v, &r2)) return false;
  for (std::size_t k = 1; k < sums_.size(); ++k) add_own(sums_[k], point.abr, groups);
  return true;
}

void NormalEquations::add_own(const Sums& sums, const Vector3& abr, std::int32_t groups) {
  Vector6& m = m_[sums.group];
  m.head<3>() += abr.z() * sums.g;
  m.tail<3>() += ray(abr).cross(sums.g);
  add_levered(sums.N, abr, &M_[in_triangle(groups, sums.group, sums.group)]);
}

bool NormalEquations::eliminate(const Problem& problem, const std::vector<SE3>& poses, std::int32_t landmark,
                                double huber, double lambda, std::int32_t groups) {
  const ProblemLandmark& point = problem.landmarks[landmark];
  const double rho = point.abr.z();
  LandmarkBlock& block = landmarks_[landmark];
  double v = 0, r2 = 0;
  if (point.depth_prior) {
    v = kDepthInformation;
    r2 = kDepthInformation * (kPriorInverseDepth - rho);
  }
  if (!sum_measurements(problem, poses, point, huber, &v, &r2)) return false;
  Matrix3 V = Matrix3::Zero();  // its lower triangle
  Vector3 right = {0, 0, r2};
  for (const Sums& sums : sums_) {
    V.topLeftCorner<2, 2>() += sums.N.topLeftCorner<2, 2>();
    V.bottomLeftCorner<1, 2>() += sums.c.head<2>().transpose();
    right.head<2>() += sums.g.head<2>();
  }
  V(2, 2) = v;
  V.diagonal() *= 1 + lambda;
  if (!invert_cholesky(V, &block.L_inverse)) return false;
  block.u.noalias() = block.L_inverse * right;

  const double a = point.abr.x(), b = point.abr.y();
  const Matrix3 L_inverse_transposed = block.L_inverse.transpose();
  block.first_slot = static_cast<std::int32_t>(slots_.size());
  for (std::size_t k = 1; k < sums_.size(); ++k) {
    const Matrix3& N = sums_[k].N;
    Matrix3 GH;  // w G' H
    GH << N.col(0), N.col(1), sums_[k].c;
    const Matrix3 X = GH * L_inverse_transposed;
    Slot& slot = slots_.emplace_back();
    slot.group = sums_[k].group;
    slot.Y.topRows<3>() = rho * X;
    slot.Y.bottomRows<3>() = skew_times(X, a, b);
    add_own(sums_[k], point.abr, groups);
    m_[slot.group].noalias() -= slot.Y * block.u;
  }
  block.end_slot = static_cast<std::int32_t>(slots_.size());
  for (std::int32_t i = block.first_slot; i < block.end_slot; ++i)
    for (std::int32_t k = i; k < block.end_slot; ++k) {
      const Slot &one = slots_[i], &other = slots_[k];
      if (one.group <= other.group)
        subtract_outer(one.Y, other.Y, &M_[in_triangle(groups, one.group, other.group)]);
      else
        subtract_outer(other.Y, one.Y, &M_[in_triangle(groups, other.group, one.group)]);
    }
  return true;
}

void NormalEquations::sum_over_descendants(const BaseGroups& base) {
  // Children come after parents, so going backwards each row is complete when it is added to its parent's. Each step
  // is the congruence M <- L M L' with L = I + e_p e_g', on the upper triangle of a symmetric M.
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
      const Matrix6 block = left * column.S;
      if (row.column == column.column)  // the edge itself, or the same edge on two paths from the base
        system_.add(row.column, row.column, p == q ? block : Matrix6(block + block.transpose()));
      else if (row.column > column.column)
        system_.add(row.column, column.column, block);
      else
        system_.add(column.column, row.column, block.transpose());
    }
  }
}

void NormalEquations::add_priors(const Problem& problem, double huber) {
  for (const ProblemEdge& edge : problem.edges) {
    if (edge.column < 0 || !edge.prior) continue;
    const Vector6 r = (edge.prior_T_ab.inverse() * edge.T_ab).log();
    const Matrix6 J = right_jacobian_inverse(r);
    const double weight = edge.prior_doubted ? huber_weight(std::sqrt(r.dot(edge.prior_information * r)), huber) : 1;
    const Matrix6 JW = weight * J.transpose() * edge.prior_information;
    system_.add(edge.column, edge.column, JW * J);
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
      Vector3 u = block.u;
      for (std::int32_t i = block.first_slot; i < block.end_slot; ++i)
        u.noalias() -= slots_[i].Y.transpose() * theta_[slots_[i].group];
      (*dl)[l].noalias() = block.L_inverse.transpose() * u;
    }
  }
}

double true_cost(const Problem& problem, const std::vector<SE3>& poses, double huber) {
  double cost = 0;
  for (const ProblemBase& base : problem.bases) {
    for (std::int32_t l = base.first_landmark; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem.landmarks[l];
      if (point.depth_prior && l < base.end_free)
        cost += kDepthInformation * std::pow(point.abr.z() - kPriorInverseDepth, 2);
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
    const double squared = r.dot(edge.prior_information * r);
    cost += edge.prior_doubted ? huber_loss(std::sqrt(squared), huber) : squared;
  }
  return cost;
}

}  // namespace relmap::rba
