// Adds the increments of words to the scores of places. Each word has a bitmap of places: bit i % 8 of byte i / 8 is
// set where place i shows the word. Words are added 32 at a time: their bitmaps are transposed into four bytes a place,
// and each byte is an index into a table of the 256 sums that eight words can have.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/place/fabmap_model.h"

namespace relmap::place {

inline constexpr std::size_t kBitmapWords = 32;
inline constexpr std::size_t kBitmapPlaces = 128;  // a bitmap's size in bits is a multiple of this

struct BitmapWords {
  std::array<const std::uint8_t*, kBitmapWords> bitmaps;  // all valid, also where the increment is 0
  std::array<LogLikelihood, kBitmapWords> increments;
};

// Adds to the score of each of `bytes` * 8 places the increments of the words that it shows. `bytes` is a multiple of
// 16.
void add_bitmaps(const BitmapWords& words, std::size_t bytes, LogLikelihood* scores);

// The same without special instructions; add_bitmaps() calls it where the processor lacks AVX-512 with VBMI and GFNI.
void add_bitmaps_portably(const BitmapWords& words, std::size_t bytes, LogLikelihood* scores);

}  // namespace relmap::place
