// Matrices of the costs of the cheapest paths between n nodes, in the (min, +) algebra.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace relmap::route {

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
  // Takes `cost` if it is lower than the known one.
  void offer(std::size_t i, std::size_t j, double cost) {
    double& best = values_[i * n_ + j];
    if (cost < best) best = cost;
  }

  CostMatrix transposed() const;

  // Eliminates the nodes from index `kept` on (the Schur complement): the costs between the nodes before account for
  // paths over the eliminated ones.
  void eliminate(std::size_t kept);
  // Makes every entry the cost of the cheapest path over any nodes (Floyd 1962).
  void close();

  std::size_t memory_bytes() const { return values_.capacity() * sizeof(double); }
  bool operator==(const CostMatrix&) const = default;

 private:
  std::size_t n_ = 0;
  std::vector<double> values_;
};

// A cost matrix in 6 bytes a cost, for searching and storing: the cost in single precision, rounded down (the floor),
// and the rest in 16 bits. The relative precision is 40 bits, 1e-12. A search reads the rest only if the floor does not
// rule the path out.
class SplitCostMatrix {
 public:
  explicit SplitCostMatrix(const CostMatrix& whole);
  // A matrix with undefined values.
  explicit SplitCostMatrix(std::size_t n)
      : n_(n), bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(memory_bytes(n))) {}
  CostMatrix whole() const;

  std::size_t size() const { return n_; }
  const float* floors(std::size_t i) const { return reinterpret_cast<const float*>(bytes_.get()) + i * n_; }
  const std::uint16_t* rests(std::size_t i) const {
    return reinterpret_cast<const std::uint16_t*>(floors(n_)) + i * n_;
  }
  // Whether no cost is negative or not a number: with such a cost, paths have no end.
  bool valid() const;
  double operator()(std::size_t i, std::size_t j) const { return joined(floors(i)[j], rests(i)[j]); }
  // The cost. The unit of the rest is 2^-39 of the power of two below the floor.
  static double joined(float floor, std::uint16_t rest) {
    if (rest == 0) return floor;
    const auto power = std::bit_cast<float>(std::bit_cast<std::uint32_t>(floor) & kExponentBits);
    return double{floor} + double{power} * kRestUnit * rest;
  }
  // The largest relative difference between a stored cost and the sum along its path.
  static constexpr double kPrecision = 4e-12;
  static constexpr std::uint32_t kExponentBits = 0x7f800000;
  static constexpr double kRestUnit = 0x1p-39;

  // The memory of the matrix, floors first.
  std::span<std::uint8_t> bytes() { return {bytes_.get(), memory_bytes(n_)}; }
  std::span<const std::uint8_t> bytes() const { return {bytes_.get(), memory_bytes(n_)}; }
  static constexpr std::size_t memory_bytes(std::size_t n) { return n * n * (sizeof(float) + sizeof(std::uint16_t)); }
  bool operator==(const SplitCostMatrix& other) const { return std::ranges::equal(bytes(), other.bytes()); }

 private:
  std::size_t n_;
  std::unique_ptr<std::uint8_t[]> bytes_;
};

}  // namespace relmap::route
