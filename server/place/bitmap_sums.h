// What words add to the scores of places, each word a bitmap of places: bit i % 8 of byte i / 8 is set where place i
// shows it. Thirty-two words at a time: their bitmaps are transposed into four bytes a place, which are numbers of rows
// in tables of the sums that eight words can have.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/place/fabmap_model.h"

namespace relmap::place {

inline constexpr std::size_t kBitmapWords = 32;
inline constexpr std::size_t kBitmapPlaces = 128;  // a bitmap's bits are a multiple of it

struct BitmapWords {
  std::array<const std::uint8_t*, kBitmapWords> bitmaps;  // all valid, of words without an increment too
  std::array<LogLikelihood, kBitmapWords> increments;
};

// scores[place] += the sum of the increments of the words it shows, for `bytes` * 8 places; `bytes` a multiple of 16.
void add_bitmaps(const BitmapWords& words, std::size_t bytes, LogLikelihood* scores);

// The same on any machine; add_bitmaps() is it where there is no AVX-512 with VBMI and GFNI.
void add_bitmaps_portably(const BitmapWords& words, std::size_t bytes, LogLikelihood* scores);

}  // namespace relmap::place
