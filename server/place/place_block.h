// A block of up to 4,096 places, in one format for memory and disk: the frames of the places, their constants and the
// words that they show. Places are in the order of their frames; a place's number within its block is its slot.
//
//    0  u32            P, places: 1 .. 4096
//    4  u32            V, words of the vocabulary
//    8  u32            R, runs of frames
//   12  u32            L, bytes of lists, below 2^31
//       u32[R][3]      runs: session, index of the first frame, number of frames; ascending, P frames in total; then
//                      zeros to a multiple of 8
//       i64[P]         constants, in steps of 2^-36 nats
//       u32[V + 1]     offset of the list of each word, and the end of the last; bit 31 is set for a bitmap
//       u8[L]          lists, each in the shorter form: slots, ascending, a u16 each; or a bitmap (bitmap_sums.h) of P
//                      bits and zeros to a multiple of 128 bits
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "server/place/bitmap_sums.h"
#include "server/place/fabmap_model.h"

namespace relmap::place {

inline constexpr std::uint32_t kPlacesPerBlock = 4096;

// Frames of consecutive indices at consecutive places.
struct FrameRun {
  FrameId first;
  std::uint32_t count = 0;
  std::uint32_t place = 0;  // the place of the first frame

  bool contains(FrameId frame) const {
    return frame.session == first.session && frame.index - first.index < count && frame.index >= first.index;
  }
};

// A view of a block's bytes, which must outlive it. Thread-safe.
class PlaceBlock {
 public:
  // Checks the bytes, all lists included. CORRUPT if they are not a block for a vocabulary of this size.
  static Result<PlaceBlock> parse(ByteSpan bytes, std::uint32_t vocabulary_size);
  // Does not check the bytes: encode_place_block() must have made them, or parse() accepted them.
  static PlaceBlock trusted(ByteSpan bytes);

  std::uint32_t places() const { return places_; }
  std::vector<FrameRun> frames() const;
  LogLikelihood constant(std::uint32_t slot) const { return load<LogLikelihood>(constants_ + 8 * std::size_t{slot}); }

  // The slots of a word, as they are stored.
  struct List {
    const std::uint8_t* bytes;
    std::uint32_t size;
    bool bitmap;
  };
  List list(std::uint32_t word) const {
    const auto from = load<std::uint32_t>(offsets_ + 4 * std::size_t{word});
    const auto to = load<std::uint32_t>(offsets_ + 4 * (std::size_t{word} + 1));
    return {lists_ + (from & ~kBitmap), (to & ~kBitmap) - (from & ~kBitmap), (from & kBitmap) != 0};
  }
  std::uint32_t bitmap_bytes() const { return bitmap_bytes(places_); }
  static constexpr std::uint32_t bitmap_bytes(std::uint32_t places) {
    return (places + kBitmapPlaces - 1) / kBitmapPlaces * (kBitmapPlaces / 8);
  }

  template <typename T>
  static T load(const std::uint8_t* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
  }

  static constexpr std::uint32_t kBitmap = std::uint32_t{1} << 31;

 private:
  PlaceBlock() = default;
  bool lay_out(ByteSpan bytes);

  std::uint32_t places_ = 0, words_ = 0, runs_ = 0;
  const std::uint8_t *frames_ = nullptr, *constants_ = nullptr, *offsets_ = nullptr, *lists_ = nullptr;
};

// Calls `visit(slot)` for each slot of the list, ascending.
template <typename Visit>
void for_each_slot(const PlaceBlock::List& list, Visit visit) {
  if (!list.bitmap) {
    for (std::uint32_t i = 0; i < list.size; i += 2) visit(PlaceBlock::load<std::uint16_t>(list.bytes + i));
    return;
  }
  for (std::uint32_t i = 0; i < list.size; i += 8)
    for (auto bits = PlaceBlock::load<std::uint64_t>(list.bytes + i); bits != 0; bits &= bits - 1)
      visit(8 * i + static_cast<std::uint32_t>(std::countr_zero(bits)));
}

struct PlaceWords {
  FrameId frame;
  std::vector<std::uint32_t> words;  // ascending, each once
};

// Encodes the places of `older`, which may be null, and `newer` as one block. They must be 1 to kPlacesPerBlock places
// of different frames. The bytes do not depend on how the places are divided between the two.
Bytes encode_place_block(const FabMapModel& model, const PlaceBlock* older, std::span<const PlaceWords> newer);

}  // namespace relmap::place
