// Chunks, the unit of paging: kFramesPerChunk consecutive frames of one session, in parts that are paged, cached and
// rewritten independently of each other.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "storage/graph/frame.h"

namespace relmap::storage {

struct ChunkId {
  SessionNumber session = 0;
  std::uint32_t chunk = 0;

  auto operator<=>(const ChunkId&) const = default;
  std::string to_string() const { return std::to_string(session) + ":" + std::to_string(chunk); }
};

inline ChunkId chunk_id(FrameId id) { return {id.session, chunk_of(id)}; }
inline std::uint32_t slot_of(FrameId id) { return id.index % kFramesPerChunk; }
inline FrameId frame_in(ChunkId id, std::uint32_t slot) { return {id.session, id.chunk * kFramesPerChunk + slot}; }

// Numbers on disk; they never change.
enum class Part : std::uint8_t { kHot = 1, kWarm = 2, kCold = 3, kWords = 4 };

inline std::string_view part_name(Part part) {
  static constexpr std::string_view kNames[] = {"?", "hot", "warm", "cold", "words"};
  return kNames[static_cast<std::size_t>(part)];
}

template <typename Frame>
inline constexpr Part kPartOf = Part::kHot;
template <>
inline constexpr Part kPartOf<FrameWarm> = Part::kWarm;
template <>
inline constexpr Part kPartOf<FrameCold> = Part::kCold;  // without the words

// One part of a chunk in memory, frame by frame; null: no such frame.
template <typename T>
using Slots = std::array<std::shared_ptr<const T>, kFramesPerChunk>;

}  // namespace relmap::storage

template <>
struct std::hash<relmap::storage::ChunkId> {
  std::size_t operator()(relmap::storage::ChunkId id) const noexcept {
    return relmap::detail::mix((std::uint64_t{id.session} << 32) | id.chunk);
  }
};
