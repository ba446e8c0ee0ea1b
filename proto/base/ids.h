// The identifiers of the map. They are values, cheap to copy and totally ordered, and mean the same on the wire, in
// memory and on disk. None is ever reused. parse() reads what to_string() writes, and returns
// nothing if the text is malformed.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace relmap {

// 128 random bits, so that no two parties choose the same one.
struct Uuid {
  std::array<std::uint8_t, 16> bytes{};

  auto operator<=>(const Uuid&) const = default;
  bool is_nil() const { return *this == Uuid{}; }
  std::string to_string() const;  // 8-4-4-4-12 hexadecimal digits
  static std::optional<Uuid> parse(std::string_view text);
  static Uuid random();  // version 4, from the system's entropy
};

// Identifies a session, one trajectory of one robot. The front-end chooses it when it begins the session.
using SessionUuid = Uuid;

// The number that the map gives a session, from 1; 0: no session.
using SessionNumber = std::uint32_t;

// A keyframe of the map. `index` is its sequence on the wire, so there may be gaps, and its chunk is known without a
// lookup.
struct FrameId {
  SessionNumber session = 0;
  std::uint32_t index = 0;

  auto operator<=>(const FrameId&) const = default;
  bool valid() const { return session != 0; }
  std::uint64_t packed() const { return (std::uint64_t{session} << 32) | index; }
  static FrameId unpack(std::uint64_t bits) {
    return {static_cast<SessionNumber>(bits >> 32), static_cast<std::uint32_t>(bits)};
  }
  std::string to_string() const;  // "3:120"
  static std::optional<FrameId> parse(std::string_view text);
};

// An edge is stored with the newer of its frames, `frame`. Ordinal 0 is the odometry (or prior) edge to the previous
// frame; 1, 2, ... are loop closures in the order in which they were proposed. Every search visits the neighbours of a
// frame in the order of edge ids (docs/method.md, 2: "increasing edge id").
struct EdgeId {
  FrameId frame;
  std::uint32_t ordinal = 0;

  auto operator<=>(const EdgeId&) const = default;
  bool valid() const { return frame.valid(); }
  std::string to_string() const;  // "3:120/1"
  static std::optional<EdgeId> parse(std::string_view text);
};

// A loop closure has the id of its edge record, whether or not it carries an edge of the graph. Invalid where an
// observation comes from tracking and not from a closure.
using ClosureId = EdgeId;

// The slot-th landmark whose base frame is `base`.
struct LandmarkId {
  FrameId base;
  std::uint32_t slot = 0;

  auto operator<=>(const LandmarkId&) const = default;
  bool valid() const { return base.valid(); }
  std::string to_string() const;  // "3:120.17"
};

// A track on the wire, unique within its session: the keyframe that introduced it, and its index there.
struct TrackId {
  std::uint32_t sequence = 0;
  std::uint32_t index = 0;

  auto operator<=>(const TrackId&) const = default;
};

namespace detail {
inline std::size_t mix(std::uint64_t x) {  // splitmix64's finaliser
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<std::size_t>(x ^ (x >> 31));
}
}  // namespace detail

}  // namespace relmap

template <>
struct std::hash<relmap::FrameId> {
  std::size_t operator()(relmap::FrameId id) const noexcept { return relmap::detail::mix(id.packed()); }
};
template <>
struct std::hash<relmap::EdgeId> {
  std::size_t operator()(relmap::EdgeId id) const noexcept {
    return relmap::detail::mix(id.frame.packed() * 31 + id.ordinal);
  }
};
template <>
struct std::hash<relmap::LandmarkId> {
  std::size_t operator()(relmap::LandmarkId id) const noexcept {
    return relmap::detail::mix(id.base.packed() * 31 + id.slot);
  }
};
template <>
struct std::hash<relmap::TrackId> {
  std::size_t operator()(relmap::TrackId id) const noexcept {
    return relmap::detail::mix((std::uint64_t{id.sequence} << 32) | id.index);
  }
};
template <>
struct std::hash<relmap::Uuid> {
  std::size_t operator()(const relmap::Uuid& id) const noexcept {
    std::uint64_t words[2];
    __builtin_memcpy(words, id.bytes.data(), sizeof words);
    return relmap::detail::mix(words[0] ^ relmap::detail::mix(words[1]));
  }
};
