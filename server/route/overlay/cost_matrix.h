// Costs of the cheapest ways between n nodes, in the algebra of (min, +).
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

// The same, to be searched and stored in 6 bytes a cost: what single precision has of it, rounded down, and the rest in
// 16 bits (40 in all: 1e-12 of it). A search reads the rest only where the first does not rule the way out.
class SplitCostMatrix {
 public:
  explicit SplitCostMatrix(const CostMatrix& whole);
  // Of no particular values.
  explicit SplitCostMatrix(std::size_t n)
      : n_(n), bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(memory_bytes(n))) {}
  CostMatrix whole() const;

  std::size_t size() const { return n_; }
  const float* floors(std::size_t i) const { return reinterpret_cast<const float*>(bytes_.get()) + i * n_; }
  const std::uint16_t* rests(std::size_t i) const {
    return reinterpret_cast<const std::uint16_t*>(floors(n_)) + i * n_;
  }
  double operator()(std::size_t i, std::size_t j) const { return joined(floors(i)[j], rests(i)[j]); }
  // The unit of a rest is 2^-39 of the power of two below the floor.
  static double joined(float floor, std::uint16_t rest) {
    if (rest == 0) return floor;
    const auto power = std::bit_cast<float>(std::bit_cast<std::uint32_t>(floor) & kExponentBits);
    return double{floor} + double{power} * kRestUnit * rest;
  }
  // By how much a cost and the sum along its way may differ: a share of it.
  static constexpr double kPrecision = 4e-12;
  static constexpr std::uint32_t kExponentBits = 0x7f800000;
  static constexpr double kRestUnit = 0x1p-39;

  // All of it, the floors first.
  std::span<std::uint8_t> bytes() { return {bytes_.get(), memory_bytes(n_)}; }
  std::span<const std::uint8_t> bytes() const { return {bytes_.get(), memory_bytes(n_)}; }
  static constexpr std::size_t memory_bytes(std::size_t n) { return n * n * (sizeof(float) + sizeof(std::uint16_t)); }
  bool operator==(const SplitCostMatrix& other) const { return std::ranges::equal(bytes(), other.bytes()); }

 private:
  std::size_t n_;
  std::unique_ptr<std::uint8_t[]> bytes_;
};

}  // namespace relmap::route
