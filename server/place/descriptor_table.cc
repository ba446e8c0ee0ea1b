#include "server/place/descriptor_table.h"

#include <algorithm>
#include <array>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace relmap::place {

DescriptorTable::DescriptorTable(std::span<const Descriptor> descriptors)
    : size_(descriptors.size()), blocks_((descriptors.size() + kLanes - 1) / kLanes) {
  for (std::size_t i = 0; i < size_; ++i) {
    Block& block = blocks_[i / kLanes];
    for (std::size_t e = 0; e < kDescriptorBytes; ++e) {
      const std::int32_t entry = descriptors[i][e];
      block.entries[e / 2][i % kLanes][e % 2] = static_cast<std::int16_t>(entry);
      block.squared_length[i % kLanes] += entry * entry;
    }
  }
}

void DescriptorTable::compare_portably(const Descriptor& d, std::span<std::int32_t> distances) const {
  for (std::size_t i = 0; i < size_; ++i) {
    const Block& block = blocks_[i / kLanes];
    std::int32_t dot = 0;
    for (std::size_t e = 0; e < kDescriptorBytes; ++e) dot += d[e] * block.entries[e / 2][i % kLanes][e % 2];
    distances[i] = block.squared_length[i % kLanes] - 2 * dot;
  }
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void DescriptorTable::compare_avx2(const Descriptor& d,
                                                           std::span<std::int32_t> distances) const {
  std::array<std::int16_t, kDescriptorBytes> wide;
  std::copy(d.begin(), d.end(), wide.begin());
  std::array<std::int32_t, kDescriptorBytes / 2> pairs;
  std::memcpy(pairs.data(), wide.data(), sizeof wide);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    __m256i dots = _mm256_setzero_si256();
    for (std::size_t pair = 0; pair < pairs.size(); ++pair)
      dots = _mm256_add_epi32(
          dots, _mm256_madd_epi16(_mm256_set1_epi32(pairs[pair]),
                                  _mm256_load_si256(reinterpret_cast<const __m256i*>(block.entries[pair]))));
    alignas(32) std::int32_t of_block[kLanes];
    const auto* lengths = reinterpret_cast<const __m256i*>(block.squared_length);
    _mm256_store_si256(reinterpret_cast<__m256i*>(of_block),
                       _mm256_sub_epi32(_mm256_load_si256(lengths), _mm256_add_epi32(dots, dots)));
    const std::size_t first = b * kLanes;
    std::copy_n(of_block, std::min(kLanes, size_ - first), distances.begin() + static_cast<std::ptrdiff_t>(first));
  }
}
#endif

RELMAP_READS_DESCRIPTORS void DescriptorTable::compare(const Descriptor& d, std::span<std::int32_t> distances) const {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2");
  if (avx2) return compare_avx2(d, distances);
#endif
  compare_portably(d, distances);
}

}  // namespace relmap::place
