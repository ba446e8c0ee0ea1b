#include "server/place/bitmap_sums.h"

#include <bit>
#include <cstring>
#include <span>

#if defined(__x86_64__)
#pragma GCC diagnostic push
// GCC 12 warns of undefined registers that are masked out; which of the two warnings depends on -O.
#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#pragma GCC diagnostic ignored "-Wuninitialized"
#include <immintrin.h>
#pragma GCC diagnostic pop
#endif

namespace relmap::place {
namespace {

static_assert(std::endian::native == std::endian::little);

// Fills `sums` with the sum of the increments of every subset of a few words; bit k of the index selects word k.
void fill(std::span<LogLikelihood> sums, const LogLikelihood* increments) {
  sums[0] = 0;
  for (std::size_t choice = 1; choice < sums.size(); ++choice)
    sums[choice] = sums[choice & (choice - 1)] + increments[std::countr_zero(choice)];
}

using TwoWords [[gnu::vector_size(16)]] = std::uint64_t;

// Transposes the eight bytes of each half as a matrix of 8 x 8 bits (Warren, Hacker's Delight, 7-3).
TwoWords transpose_bits(TwoWords x) {
  TwoWords t = (x ^ (x >> 7)) & 0x00AA00AA00AA00AAu;
  x ^= t ^ (t << 7);
  t = (x ^ (x >> 14)) & 0x0000CCCC0000CCCCu;
  x ^= t ^ (t << 14);
  t = (x ^ (x >> 28)) & 0x00000000F0F0F0F0u;
  return x ^ t ^ (t << 28);
}

// One step of a matrix transposition: swaps the off-diagonal blocks of rows that are `distance` apart.
template <std::size_t distance>
void exchange(TwoWords* rows, std::uint64_t mask) {
  for (std::size_t row = 0; row < 8; ++row) {
    if (row & distance) continue;
    const TwoWords t = ((rows[row] >> 8 * distance) ^ rows[row + distance]) & mask;
    rows[row + distance] ^= t;
    rows[row] ^= t << 8 * distance;
  }
}

// Transposes eight rows as a matrix of 8 x 8 bytes, in each half.
void transpose_bytes(TwoWords* rows) {
  exchange<1>(rows, 0x00FF00FF00FF00FFu);
  exchange<2>(rows, 0x0000FFFF0000FFFFu);
  exchange<4>(rows, 0x00000000FFFFFFFFu);
}

// Writes a byte for each of 128 places; bit k is the place's bit in bitmaps[k].
void choices_of(const std::uint8_t* const* bitmaps, std::size_t at, std::uint8_t* choices) {
  TwoWords rows[8];
  for (std::size_t k = 0; k < 8; ++k) std::memcpy(&rows[k], bitmaps[k] + at, sizeof rows[k]);
  transpose_bytes(rows);
  for (std::size_t k = 0; k < 8; ++k) {
    const TwoWords transposed = transpose_bits(rows[k]);
    const std::uint64_t lower = transposed[0], upper = transposed[1];
    std::memcpy(choices + 8 * k, &lower, 8);
    std::memcpy(choices + 64 + 8 * k, &upper, 8);
  }
}

#if defined(__x86_64__)

#define RELMAP_AVX512 __attribute__((target("avx512f,avx512bw,avx512vbmi,gfni")))

// Returns a byte for each of 64 places; byte b of lane q is that of place 8 b + q.
RELMAP_AVX512 inline __m512i choices_of(const std::uint8_t* const* bitmaps, std::size_t at, __m512i transposed,
                                        __m512i identity) {
  long long rows[8];
  for (std::size_t k = 0; k < 8; ++k) std::memcpy(&rows[k], bitmaps[k] + at, 8);
  // The matrix product takes the last row first.
  const __m512i by_word = _mm512_set_epi64(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7]);
  const __m512i by_eight_places = _mm512_permutexvar_epi8(transposed, by_word);
  const __m512i by_place = _mm512_gf2p8affine_epi64_epi8(identity, by_eight_places, 0);
  return _mm512_permutexvar_epi8(transposed, by_place);
}

struct Nibble {
  __m512i low, high;  // the 16 sums of four words
};

RELMAP_AVX512 inline __m512i add(__m512i scores, const Nibble& nibble, __m512i choices) {
  return _mm512_add_epi64(scores, _mm512_permutex2var_epi64(nibble.low, choices, nibble.high));
}

RELMAP_AVX512 void add_bitmaps_avx512(const BitmapWords& words, std::size_t bytes, LogLikelihood* scores) {
  alignas(64) std::uint8_t order[64];
  for (std::uint8_t i = 0; i < 64; ++i) order[i] = static_cast<std::uint8_t>(i % 8 * 8 + i / 8);
  const __m512i transposed = _mm512_load_si512(order), identity = _mm512_set1_epi64(0x8040201008040201);
  constexpr std::size_t kGroups = kBitmapWords / 8;
  Nibble nibbles[2 * kGroups];
  for (std::size_t n = 0; n < 2 * kGroups; ++n) {
    alignas(64) LogLikelihood sums[16];
    fill(sums, words.increments.data() + 4 * n);
    nibbles[n] = {_mm512_load_si512(sums), _mm512_load_si512(sums + 8)};
  }
  for (std::size_t at = 0; at < bytes; at += 8, scores += 64) {
    __m512i choices[kGroups];
    for (std::size_t g = 0; g < kGroups; ++g)
      choices[g] = choices_of(words.bitmaps.data() + 8 * g, at, transposed, identity);
#pragma GCC unroll 8
    for (unsigned b = 0; b < 8; ++b) {
      __m512i sum = _mm512_loadu_si512(scores + 8 * b);
#pragma GCC unroll 4
      for (std::size_t g = 0; g < kGroups; ++g) {
        sum = add(sum, nibbles[2 * g], _mm512_srli_epi64(choices[g], 8 * b));
        sum = add(sum, nibbles[2 * g + 1], _mm512_srli_epi64(choices[g], 8 * b + 4));
      }
      _mm512_storeu_si512(scores + 8 * b, sum);
    }
  }
}

bool has_avx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512vbmi") && __builtin_cpu_supports("gfni");
}

#endif

}  // namespace

void add_bitmaps_portably(const BitmapWords& words, std::size_t bytes, LogLikelihood* scores) {
  constexpr std::size_t kGroups = kBitmapWords / 8;
  std::array<LogLikelihood, 256> sums[kGroups];
  for (std::size_t g = 0; g < kGroups; ++g) fill(sums[g], words.increments.data() + 8 * g);
  for (std::size_t at = 0; at < bytes; at += kBitmapPlaces / 8, scores += kBitmapPlaces) {
    std::uint8_t choices[kGroups][kBitmapPlaces];
    for (std::size_t g = 0; g < kGroups; ++g) choices_of(words.bitmaps.data() + 8 * g, at, choices[g]);
    for (std::size_t i = 0; i < kBitmapPlaces; ++i)
      scores[i] +=
          (sums[0][choices[0][i]] + sums[1][choices[1][i]]) + (sums[2][choices[2][i]] + sums[3][choices[3][i]]);
  }
}

void add_bitmaps(const BitmapWords& words, std::size_t bytes, LogLikelihood* scores) {
#if defined(__x86_64__)
  static const bool fast = has_avx512();
  if (fast) return add_bitmaps_avx512(words, bytes, scores);
#endif
  add_bitmaps_portably(words, bytes, scores);
}

}  // namespace relmap::place
