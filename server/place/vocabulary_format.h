// The format of a vocabulary file, version 1. Little-endian. Every table begins at a multiple of 4 bytes, so that the
// mapped file can be used in place.
//
//    0  u8[8]        "RELMAPVO"
//    8  u32          version
//   12  u32          W, words: 1 .. 2^20
//   16  u32          K, branches: 1 .. W
//   20  u32          S, sample places: 1 .. 2^16
//   24  u32          N, words of all sample places in total
//   28  u32          bytes of the source text, at most 4096
//   32  u8[]         source text (UTF-8), zeros to the next multiple of 4
//       u8[K][128]   centroids of the branches
//       u32[K + 1]   first word of each branch, ascending, no branch empty; the last is W
//       u8[W][128]   centroids of the words
//       u32[W]       parent in the Chow-Liu tree; the one root is its own
//       f32[W]       p(z = 1)
//       f32[W]       p(z = 1 | parent absent); the root: p(z = 1)
//       f32[W]       p(z = 1 | parent present); the root: p(z = 1)
//       u32[S + 1]   first entry of each sample place in the next table; the last is N
//       u32[N]       words of the sample places, ascending within each
//       u32          CRC32C of all bytes before
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "server/place/descriptor.h"

namespace relmap::place {

inline constexpr std::uint32_t kVocabularyVersion = 1;
inline constexpr std::uint32_t kMaxWords = 1u << 20;
inline constexpr std::uint32_t kMaxSamplePlaces = 1u << 16;
inline constexpr std::size_t kMaxSourceBytes = 4096;

// All probabilities of the model lie within [kProbabilityFloor, 1 - kProbabilityFloor].
inline constexpr double kProbabilityFloor = 1e-4;
inline double clip_probability(double p) { return std::clamp(p, kProbabilityFloor, 1 - kProbabilityFloor); }

// The content of a vocabulary file.
struct VocabularyModel {
  std::string source;
  std::vector<Descriptor> branches;
  std::vector<std::uint32_t> branch_begin;  // one more than there are branches
  std::vector<Descriptor> centroids;
  std::vector<std::uint32_t> parent;
  std::vector<float> marginal, given_parent_absent, given_parent_present;
  std::vector<std::vector<std::uint32_t>> sample_places;
};

// The same as views of the bytes.
struct VocabularyTables {
  std::string_view source;
  std::span<const Descriptor> branches;
  std::span<const std::uint32_t> branch_begin;
  std::span<const Descriptor> centroids;
  std::span<const std::uint32_t> parent;
  std::span<const float> marginal, given_parent_absent, given_parent_present;
  std::span<const std::uint32_t> sample_begin, sample_words;
  std::uint32_t crc = 0;
};

Bytes encode_vocabulary(const VocabularyModel& model);

// Checks the bytes of a file and returns its tables. `bytes` must begin at a multiple of 4 and outlive the tables.
// CORRUPT (wrong magic, sizes or checksum, or a table that no trainer writes), UNKNOWN_FORMAT_VERSION.
Result<VocabularyTables> parse_vocabulary(ByteSpan bytes);

}  // namespace relmap::place
