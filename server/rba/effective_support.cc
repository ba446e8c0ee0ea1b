#include "server/rba/effective_support.h"

#include <algorithm>
#include <cmath>

namespace relmap::rba {

namespace {

constexpr double kNothing = 1e-3;  // observations; keeps L positive definite where nothing measures an edge

}  // namespace

const std::vector<double>& EffectiveSupport::compute(const Problem& problem) {
  const std::int32_t columns = problem.columns;
  const bool exact = columns <= kMaxColumns;
  support_.assign(static_cast<std::size_t>(columns), 0);
  sum_paths(problem, exact);
  if (!exact) return support_;
  factor(columns);
  invert(columns);
  // The diagonal of L^-1 is the sum of the squares in each column of the inverse factor.
  for (std::int32_t row = 0; row < columns; ++row)
    for (std::int32_t column = 0; column <= row; ++column)
      support_[static_cast<std::size_t>(column)] += at(row, column) * at(row, column);
  for (double& support : support_) support = std::max(0.0, 1 / support - kNothing);
  return support_;
}

void EffectiveSupport::sum_paths(const Problem& problem, bool pairs) {
  if (pairs) {
    const auto columns = static_cast<std::size_t>(problem.columns);
    matrix_.assign(columns * (columns + 1) / 2, 0);
    for (std::int32_t column = 0; column < problem.columns; ++column) at(column, column) = kNothing;
  }
  beyond_.assign(problem.nodes.size(), 0);
  for (const ProblemBase& base : problem.bases) {
    for (std::int32_t l = base.first_landmark; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem.landmarks[l];
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o)
        beyond_[problem.observations[o].node] += problem.observations[o].counted;
    }
    for (std::int32_t n = base.end_node - 1; n > base.first_node; --n) {
      const ProblemNode& node = problem.nodes[n];
      beyond_[node.parent] += beyond_[n];
      const std::int32_t column = problem.edges[node.edge].column;
      if (column < 0 || beyond_[n] == 0) continue;
      if (!pairs) {
        support_[static_cast<std::size_t>(column)] += beyond_[n];
        continue;
      }
      at(column, column) += beyond_[n];
      for (std::int32_t up = node.parent; problem.nodes[up].parent >= 0; up = problem.nodes[up].parent) {
        const ProblemNode& above = problem.nodes[up];
        const std::int32_t other = problem.edges[above.edge].column;
        if (other < 0) continue;
        const double product = above.forward == node.forward ? beyond_[n] : -beyond_[n];
        at(std::max(column, other), std::min(column, other)) += product;
      }
    }
  }
}

void EffectiveSupport::factor(std::int32_t columns) {
  for (std::int32_t row = 0; row < columns; ++row) {
    double* const own = &at(row, 0);
    for (std::int32_t column = 0; column < row; ++column) {
      const double* const other = &at(column, 0);
      double sum = own[column];
      for (std::int32_t k = 0; k < column; ++k) sum -= own[k] * other[k];
      own[column] = sum / other[column];
    }
    double sum = own[row];
    for (std::int32_t k = 0; k < row; ++k) sum -= own[k] * own[k];
    own[row] = std::sqrt(std::max(sum, kNothing));
  }
}

void EffectiveSupport::invert(std::int32_t columns) {
  for (std::int32_t row = 0; row < columns; ++row) {
    double* const own = &at(row, 0);
    const double pivot = 1 / own[row];
    row_.assign(static_cast<std::size_t>(row), 0);  // own[0 .. row) times the inverse of the rows above
    for (std::int32_t k = 0; k < row; ++k) {
      const double* const above = &at(k, 0);
      for (std::int32_t column = 0; column <= k; ++column)
        row_[static_cast<std::size_t>(column)] += own[k] * above[column];
    }
    for (std::int32_t column = 0; column < row; ++column) own[column] = -pivot * row_[static_cast<std::size_t>(column)];
    own[row] = pivot;
  }
}

}  // namespace relmap::rba
