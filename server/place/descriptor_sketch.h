// Sketches of descriptors, by which most of those that are not alike are told apart at a fifth of the cost.
//
// A sketch is a part of the descriptor's Walsh-Hadamard transform H x. Since H is orthogonal up to scale,
// |H x - H y|^2 = 128 |x - y|^2, and the part of that sum that sketches hold is a lower bound. So what they rule out is
// not near, whatever the descriptors are; which part is held decides only how often they rule out.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/place/descriptor.h"

namespace relmap::place {

inline constexpr std::size_t kSketched = 32;  // coefficients
using DescriptorSketch = std::array<std::int16_t, kSketched>;

DescriptorSketch sketch(const Descriptor& descriptor);

// The sketches of many descriptors. Const members are thread-safe.
class DescriptorSketches {
 public:
  explicit DescriptorSketches(std::span<const Descriptor* const> descriptors);

  // Appends to `near`, in ascending order, the numbers of the descriptors that the sketches do not rule out to be
  // within `max_squared` (0 to 128 * 255^2, the largest squared distance) of the one that `from` is of.
  void find_near(const DescriptorSketch& from, std::uint32_t max_squared, std::vector<std::uint32_t>& near) const;

 private:
  // Eight sketches, by pairs of coefficients.
  static constexpr std::size_t kLanes = 8;
  struct alignas(32) Block {
    std::int16_t coefficients[kSketched / 2][kLanes][2] = {};
  };

  bool rules_out(const DescriptorSketch& from, std::uint32_t max_squared, std::uint32_t number) const;
  void find_near_portably(const DescriptorSketch& from, std::uint32_t max_squared,
                          std::vector<std::uint32_t>& near) const;
#if defined(__x86_64__)
  void find_near_avx2(const DescriptorSketch& from, std::uint32_t max_squared, std::vector<std::uint32_t>& near) const;
#endif

  std::size_t size_;
  std::vector<Block> blocks_;
};

}  // namespace relmap::place
