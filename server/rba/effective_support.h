// How well each moving edge of a problem is measured, as a number of observations.
//
// The number of observations whose path uses an edge says too much: if all of them use the next edge, too, they measure
// the product of both, and the frame between may be anywhere. So each observation is taken as one measurement of the
// signed sum of the moving edges on its path, as if transforms were scalars and landmarks were known. With L = sum p
// p', where p has +1 or -1 for each of these edges, 1 / (L^-1)_ee is the number of observations that would measure edge
// e as well if each of them used e alone; the other moving edges are unknown.
#pragma once

#include <cstdint>
#include <vector>

#include "server/rba/problem.h"

namespace relmap::rba {

class EffectiveSupport {
 public:
  static constexpr std::int32_t kMaxColumns = 256;  // the cost is cubic

  // By column; between 0 and the number of counted observations whose path uses the edge. Above kMaxColumns it is that
  // number.
  const std::vector<double>& compute(const Problem& problem);
  double of(std::int32_t column) const { return support_[static_cast<std::size_t>(column)]; }  // as last computed

 private:
  double& at(std::int32_t row, std::int32_t column) {  // row >= column
    return matrix_[static_cast<std::size_t>(row) * (static_cast<std::size_t>(row) + 1) / 2 +
                   static_cast<std::size_t>(column)];
  }
  void sum_paths(const Problem& problem, bool pairs);
  void factor(std::int32_t columns);
  void invert(std::int32_t columns);

  std::vector<double> matrix_;  // lower triangle by rows: L, then its Cholesky factor, then the inverse of that
  std::vector<double> support_, row_;
  std::vector<std::int32_t> beyond_;  // by node: counted observations whose path ends there or beyond
};

}  // namespace relmap::rba
