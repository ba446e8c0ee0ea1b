#include "server/place/descriptor_sketch.h"

#include <algorithm>
#include <bit>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace relmap::place {
namespace {

// The coefficients in which SIFT descriptors of different points differ most: in rendered and real drives and flights,
// these are 69 % of their squared distance. The bits of a number, from the lowest, say by which bits of orientation
// (three), column (two) and row (two) the sign changes.
constexpr std::array<std::uint8_t, kSketched> kCoefficients{22, 6,   4,  2,  3,   14, 68, 20, 30, 18, 19,
                                                            66, 67,  21, 16, 100, 5,  7,  92, 84, 1,  28,
                                                            86, 116, 70, 36, 26,  64, 0,  94, 29, 27};

// 128 times the squared distance. Of any two descriptors it is below 2^30, so sums of its parts do not overflow.
std::int32_t scaled(std::uint32_t max_squared) { return static_cast<std::int32_t>(max_squared * kDescriptorBytes); }

constexpr std::size_t kOrientations = 8, kCells = kDescriptorBytes / kOrientations;
using Bytes8 [[gnu::vector_size(8)]] = std::uint8_t;
using Row [[gnu::vector_size(16)]] = std::int16_t;  // eight numbers

// Replaces each two rows whose numbers differ in one bit by their sum and difference, bit by bit.
template <std::size_t Rows>
void transform_rows(Row* rows) {
  for (std::size_t bit = 1; bit < Rows; bit *= 2)
    for (std::size_t begin = 0; begin < Rows; begin += 2 * bit)
      for (std::size_t row = begin; row < begin + bit; ++row) {
        const Row x = rows[row], y = rows[row + bit];
        rows[row] = x + y;
        rows[row + bit] = x - y;
      }
}

// Exchanges rows and columns of eight rows: three perfect shuffles of the 64 numbers.
void transpose(Row* rows) {
  for (int shuffle = 0; shuffle < 3; ++shuffle) {
    Row mixed[8];
    for (int i = 0; i < 4; ++i) {
      mixed[2 * i] = __builtin_shufflevector(rows[i], rows[i + 4], 0, 8, 1, 9, 2, 10, 3, 11);
      mixed[2 * i + 1] = __builtin_shufflevector(rows[i], rows[i + 4], 4, 12, 5, 13, 6, 14, 7, 15);
    }
    std::copy_n(mixed, 8, rows);
  }
}

}  // namespace

// A coefficient is at most 128 * 255, and two of them differ by no more: both fit into 16 bits.
RELMAP_READS_DESCRIPTORS DescriptorSketch sketch(const Descriptor& descriptor) {
  Row rows[kCells];  // of a cell's orientations
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    Bytes8 bytes;
    std::memcpy(&bytes, &descriptor[cell * kOrientations], sizeof bytes);
    rows[cell] = __builtin_convertvector(bytes, Row);
  }
  transform_rows<kCells>(rows);
  for (Row* half : {&rows[0], &rows[8]}) {  // of an orientation's cells, from now on
    transpose(half);
    transform_rows<kOrientations>(half);
  }
  DescriptorSketch sketch;
  for (std::size_t i = 0; i < kSketched; ++i) {
    const std::size_t orientation = kCoefficients[i] % kOrientations, cell = kCoefficients[i] / kOrientations;
    sketch[i] = rows[cell / 8 * 8 + orientation][cell % 8];
  }
  return sketch;
}

DescriptorSketches::DescriptorSketches(std::span<const Descriptor* const> descriptors)
    : size_(descriptors.size()), blocks_((descriptors.size() + kLanes - 1) / kLanes) {
  for (std::size_t i = 0; i < size_; ++i) {
    const DescriptorSketch one = sketch(*descriptors[i]);
    for (std::size_t pair = 0; pair < kSketched / 2; ++pair)
      std::copy_n(&one[2 * pair], 2, blocks_[i / kLanes].coefficients[pair][i % kLanes]);
  }
}

bool DescriptorSketches::rules_out(const DescriptorSketch& from, std::uint32_t max_squared,
                                   std::uint32_t number) const {
  const Block& block = blocks_[number / kLanes];
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < kSketched; ++i) {
    const std::int32_t difference = block.coefficients[i / 2][number % kLanes][i % 2] - from[i];
    sum += difference * difference;
  }
  return sum > scaled(max_squared);
}

void DescriptorSketches::find_near_portably(const DescriptorSketch& from, std::uint32_t max_squared,
                                            std::vector<std::uint32_t>& near) const {
  for (std::uint32_t i = 0; i < size_; ++i)
    if (!rules_out(from, max_squared, i)) near.push_back(i);
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void DescriptorSketches::find_near_avx2(const DescriptorSketch& from, std::uint32_t max_squared,
                                                                std::vector<std::uint32_t>& near) const {
  __m256i asked[kSketched / 2];
  for (std::size_t pair = 0; pair < kSketched / 2; ++pair) {
    std::int32_t both;
    std::memcpy(&both, &from[2 * pair], sizeof both);
    asked[pair] = _mm256_set1_epi32(both);
  }
  const __m256i max = _mm256_set1_epi32(scaled(max_squared));
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    __m256i sums = _mm256_setzero_si256();
    for (std::size_t pair = 0; pair < kSketched / 2; ++pair) {
      const auto* coefficients = reinterpret_cast<const __m256i*>(blocks_[b].coefficients[pair]);
      const __m256i difference = _mm256_sub_epi16(asked[pair], _mm256_load_si256(coefficients));
      sums = _mm256_add_epi32(sums, _mm256_madd_epi16(difference, difference));
    }
    const auto farther = static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpgt_epi32(sums, max))));
    for (unsigned left = ~farther & 0xff; left != 0; left &= left - 1)
      if (const std::size_t i = b * kLanes + static_cast<unsigned>(std::countr_zero(left)); i < size_)
        near.push_back(static_cast<std::uint32_t>(i));
  }
}
#endif

void DescriptorSketches::find_near(const DescriptorSketch& from, std::uint32_t max_squared,
                                   std::vector<std::uint32_t>& near) const {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2");
  if (avx2) return find_near_avx2(from, max_squared, near);
#endif
  find_near_portably(from, max_squared, near);
}

}  // namespace relmap::place
