#include "server/route/overlay/cost_matrix.h"

#include <algorithm>
#include <cmath>

namespace relmap::route {
namespace {

using OfferRow = void (*)(double* row, const double* other, double cost, std::size_t n);

inline void offer_each(double* __restrict row, const double* __restrict other, double cost, std::size_t n) {
  for (std::size_t j = 0; j < n; ++j) {
    const double way = cost + other[j];
    row[j] = way < row[j] ? way : row[j];
  }
}

void offer_portably(double* row, const double* other, double cost, std::size_t n) { offer_each(row, other, cost, n); }

#if defined(__x86_64__)
__attribute__((target("avx2"))) void offer_avx2(double* __restrict row, const double* __restrict other, double cost,
                                                std::size_t n) {
  for (std::size_t j = 0; j < n; ++j) {
    const double way = cost + other[j];
    row[j] = way < row[j] ? way : row[j];
  }
}
#endif

OfferRow fastest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return offer_avx2;
#endif
  return offer_portably;
}

// row[j] = min(row[j], cost + other[j])
void offer_row(double* row, const double* other, double cost, std::size_t n) {
  static const OfferRow offer = fastest();
  offer(row, other, cost, n);
}

}  // namespace

CostMatrix CostMatrix::transposed() const {
  CostMatrix other(n_);
  for (std::size_t i = 0; i < n_; ++i)
    for (std::size_t j = 0; j < n_; ++j) other.row(j)[i] = row(i)[j];
  return other;
}

void CostMatrix::eliminate(std::size_t kept) {
  for (std::size_t pivot = n_; pivot-- > kept;)
    for (std::size_t i = 0; i < pivot; ++i)
      if (const double to_pivot = row(i)[pivot]; to_pivot < kUnreachable)
        offer_row(row(i), row(pivot), to_pivot, pivot);
  CostMatrix rest(kept);
  for (std::size_t i = 0; i < kept; ++i) std::copy(row(i), row(i) + kept, rest.row(i));
  *this = std::move(rest);
}

void CostMatrix::close() {
  for (std::size_t pivot = 0; pivot < n_; ++pivot)
    for (std::size_t i = 0; i < n_; ++i)
      if (const double to_pivot = row(i)[pivot]; i != pivot && to_pivot < kUnreachable)
        offer_row(row(i), row(pivot), to_pivot, n_);
}

SplitCostMatrix::SplitCostMatrix(const CostMatrix& whole) : SplitCostMatrix(whole.size()) {
  auto* floors = reinterpret_cast<float*>(bytes_.get());
  auto* rests = reinterpret_cast<std::uint16_t*>(floors + n_ * n_);
  for (std::size_t i = 0; i < n_; ++i)
    for (std::size_t j = 0; j < n_; ++j, ++floors, ++rests) {
      constexpr double kMaxCost = std::numeric_limits<float>::max();  // an invalid covariance may give more
      const double cost = whole(i, j) < kUnreachable ? std::min(whole(i, j), kMaxCost) : kUnreachable;
      auto floor = static_cast<float>(cost);
      if (double{floor} > cost) floor = std::nextafter(floor, 0.0f);
      *floors = floor;
      const double unit = joined(floor, 1) - double{floor};  // 0 if the floor is denormal
      *rests = cost < kUnreachable && unit > 0
                   ? static_cast<std::uint16_t>(std::min(std::floor((cost - double{floor}) / unit + 0.5), 65535.0))
                   : std::uint16_t{0};
    }
}

bool SplitCostMatrix::valid() const {
  const auto* floors = reinterpret_cast<const std::uint32_t*>(bytes_.get());
  std::uint32_t highest = 0;  // as numbers, the bits of all that is not valid are above those of infinity
  for (std::size_t i = 0; i < n_ * n_; ++i) highest = std::max(highest, floors[i]);
  return highest <= kExponentBits;
}

CostMatrix SplitCostMatrix::whole() const {
  CostMatrix whole(n_);
  for (std::size_t i = 0; i < n_; ++i)
    for (std::size_t j = 0; j < n_; ++j) whole.row(i)[j] = (*this)(i, j);
  return whole;
}

}  // namespace relmap::route
