// Costs of the cheapest ways between n nodes, in the algebra of (min, +).
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace relmap {

inline constexpr double kUnreachable = std::numeric_limits<double>::infinity();

class CostMatrix {
 public:
  CostMatrix() = default;
  explicit CostMatrix(std::size_t n) : n_(n), values_(n * n, kUnreachable) {
    for (std::size_t i = 0; i < n; ++i) values_[i * n + i] = 0;
  }

  std::size_t size() const { return n_; }
  double* row(std::size_t i) { return values_.data() + i * n_; }
  const double* row(std::size_t i) const { return values_.data() + i * n_; }
  double operator()(std::size_t i, std::size_t j) const { return values_[i * n_ + j]; }
  // By another way.
  void offer(std::size_t i, std::size_t j, double cost) {
    double& best = values_[i * n_ + j];
    if (cost < best) best = cost;
  }

  CostMatrix transposed() const;

  // The Schur complement: of ways over the nodes from `kept` on only their cost is left, between the nodes before.
  void eliminate(std::size_t kept);
  // Every entry becomes that of the cheapest way over any of the nodes (Floyd 1962).
  void close();

  std::size_t memory_bytes() const { return values_.capacity() * sizeof(double); }
  bool operator==(const CostMatrix&) const = default;

 private:
  std::size_t n_ = 0;
  std::vector<double> values_;
};

// The same, to be searched and stored: of each cost what single precision has of it, rounded down, and the rest (47
// bits of 53 in all). A search reads the rest only where the first does not rule the way out.
class SplitCostMatrix {
 public:
  explicit SplitCostMatrix(const CostMatrix& whole);
  // Of no particular values.
  explicit SplitCostMatrix(std::size_t n) : n_(n), values_(std::make_unique_for_overwrite<float[]>(2 * n * n)) {}
  CostMatrix whole() const;

  std::size_t size() const { return n_; }
  const float* floors(std::size_t i) const { return values_.get() + i * n_; }
  const float* rests(std::size_t i) const { return values_.get() + (n_ + i) * n_; }
  float* floors(std::size_t i) { return values_.get() + i * n_; }
  float* rests(std::size_t i) { return values_.get() + (n_ + i) * n_; }
  double operator()(std::size_t i, std::size_t j) const { return double{floors(i)[j]} + double{rests(i)[j]}; }
  // All of them, the floors first.
  std::span<float> values() { return {values_.get(), 2 * n_ * n_}; }
  std::span<const float> values() const { return {values_.get(), 2 * n_ * n_}; }
  bool operator==(const SplitCostMatrix& other) const {
    return std::equal(values().begin(), values().end(), other.values().begin(), other.values().end());
  }

 private:
  std::size_t n_;
  std::unique_ptr<float[]> values_;
};

}  // namespace relmap
