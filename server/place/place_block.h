// Up to 4,096 places as bytes, in memory as on disk: which frames they are, their constants, and which words they show.
// Places stand in the order of their frames; a place's number within its block is its slot.
//
//    0  u32            P, places: 1 .. 4096
//    4  u32            V, words of the vocabulary
//    8  u32            C, columns of 64 common words
//   12  u32            R, runs of frames
//   16  u32            L, bytes of lists, below 2^31
//   20  u32            0
//       u32[R][3]      session, index of the first frame, frames: ascending, P together; zeros to a multiple of 8
//       i64[P]         constants, 2^-36 nats
//       u64[C][P]      by column: bit i: the place shows common word 64 c + i
//       u32[V + 1]     where the list of each word begins, and the last ends; bit 31: how it is written
//       u8[L]          lists of the words that are not common: slots, ascending. With bit 31 a u16 each, else a u8
//       each,
//                      the distance from the one before (from 0), where none is above 255
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "proto/bytes.h"
#include "proto/ids.h"
#include "proto/status.h"
#include "server/place/common_words.h"
#include "server/place/fabmap_model.h"

namespace relmap {

inline constexpr std::uint32_t kPlacesPerBlock = 4096;

// Frames of consecutive indices at consecutive places.
struct FrameRun {
  FrameId first;
  std::uint32_t count = 0;
  std::uint32_t place = 0;  // of the first

  bool contains(FrameId frame) const {
    return frame.session == first.session && frame.index - first.index < count && frame.index >= first.index;
  }
};

// A view into its bytes, which must outlive it. Thread-safe.
class PlaceBlock {
 public:
  // CORRUPT: not a block of this vocabulary. Every list is read.
  static Result<PlaceBlock> parse(ByteSpan bytes, const CommonWords& common);
  // Of bytes that encode_place_block() made or parse() has accepted.
  static PlaceBlock trusted(ByteSpan bytes);

  std::uint32_t places() const { return places_; }
  std::uint32_t columns() const { return columns_; }
  std::vector<FrameRun> frames() const;
  LogLikelihood constant(std::uint32_t slot) const { return load<LogLikelihood>(constants_ + 8 * std::size_t{slot}); }
  std::uint64_t bits(std::uint32_t column, std::uint32_t slot) const {
    return load<std::uint64_t>(bits_ + 8 * (std::size_t{column} * places_ + slot));
  }

  // The slots of a word, as they are written.
  struct List {
    const std::uint8_t* bytes;
    std::uint32_t size;
    bool wide;
  };
  List list(std::uint32_t word) const {
    const auto from = load<std::uint32_t>(offsets_ + 4 * std::size_t{word});
    const auto to = load<std::uint32_t>(offsets_ + 4 * (std::size_t{word} + 1));
    return {lists_ + (from & ~kWide), (to & ~kWide) - (from & ~kWide), (from & kWide) != 0};
  }

  template <typename T>
  static T load(const std::uint8_t* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
  }

  static constexpr std::uint32_t kWide = std::uint32_t{1} << 31;

 private:
  PlaceBlock() = default;
  bool lay_out(ByteSpan bytes);

  std::uint32_t places_ = 0, words_ = 0, columns_ = 0, runs_ = 0, list_bytes_ = 0;
  const std::uint8_t *frames_ = nullptr, *constants_ = nullptr, *bits_ = nullptr, *offsets_ = nullptr,
                     *lists_ = nullptr;
};

// `visit(slot)` for each, ascending.
template <typename Visit>
void for_each_slot(const PlaceBlock::List& list, Visit visit) {
  if (list.wide) {
    for (std::uint32_t i = 0; i + 1 < list.size; i += 2) visit(PlaceBlock::load<std::uint16_t>(list.bytes + i));
    return;
  }
  std::uint32_t slot = 0;
  for (std::uint32_t i = 0; i < list.size; ++i) visit(slot += list.bytes[i]);
}

struct PlaceWords {
  FrameId frame;
  std::vector<std::uint32_t> words;  // ascending, each once
};

// The places of `older`, if there is one, and `newer`: at most kPlacesPerBlock, all of different frames. The same bytes
// however they are divided between the two.
Bytes encode_place_block(const FabMapModel& model, const CommonWords& common, const PlaceBlock* older,
                         std::span<const PlaceWords> newer);

}  // namespace relmap
