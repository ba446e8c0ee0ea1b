#include "tests/camera/default_frame.h"

#include <cstring>
#include <random>
#include <stdexcept>
#include <vector>

namespace relmap::testing {

namespace {

constexpr std::size_t kMaxBytes = std::size_t{2} * 1280 * 960;
constexpr std::size_t kTextures = 1024, kStep = 64;  // each begins so many bytes later in one long noise

const std::vector<std::uint8_t>& noise() {
  static const std::vector<std::uint8_t> kNoise = [] {
    std::vector<std::uint8_t> bytes(kMaxBytes + kTextures * kStep);
    std::mt19937 random(1);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() >> 24);
    return bytes;
  }();
  return kNoise;
}

constexpr std::size_t kNumberAt = 64, kNumberEnd = kNumberAt + sizeof(std::uint64_t);

const std::uint8_t* noise_of(std::uint64_t number) { return noise().data() + number % kTextures * kStep; }

}  // namespace

void default_frame(std::uint64_t number, std::span<std::uint8_t> bytes) {
  if (bytes.size() < kNumberEnd || bytes.size() > kMaxBytes) throw std::length_error("default_frame");
  std::memcpy(bytes.data(), noise_of(number), bytes.size());
  std::memcpy(bytes.data() + kNumberAt, &number, sizeof number);
}

std::optional<std::uint64_t> default_frame_number(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kNumberEnd || bytes.size() > kMaxBytes) return std::nullopt;
  std::uint64_t number;
  std::memcpy(&number, bytes.data() + kNumberAt, sizeof number);
  const bool whole =
      std::memcmp(bytes.data() + kNumberEnd, noise_of(number) + kNumberEnd, bytes.size() - kNumberEnd) == 0;
  return whole ? std::optional(number) : std::nullopt;
}

}  // namespace relmap::testing
