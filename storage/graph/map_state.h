// What a map knows of itself beside its frames and sessions.
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <string>

#include "proto/base/ids.h"
#include "proto/base/map_identity.h"
#include "proto/keyframe/extensions.h"
#include "storage/graph/chunk.h"
#include "storage/graph/frame_set.h"

namespace relmap::storage {

// Facts of the map as a whole; every view has its own copy.
struct MapFacts {
  std::uint64_t applied_sequence = 0;
  std::array<std::uint64_t, 128> refused{};  // keyframes refused, by Reason
  std::uint64_t keyframes = 0;               // in the map
  std::uint64_t gaps = 0;                    // sequences in gaps
  std::uint64_t closures_accepted = 0;
  std::uint64_t closures_candidate = 0;
  std::uint64_t closures_quarantined = 0;
  std::uint64_t closures_removed = 0;
  std::uint64_t numerical_failures = 0;  // solves that failed and left the map as it was
  std::uint32_t vocabulary_crc = 0;      // of the vocabulary that made the words; 0: none yet
  MapIdentity identity;                  // unknown until a daemon that gives maps an identity serves the map
};

// By what a caller names an edit, so that it is done once however often it is sent.
struct EditKey {
  std::string key;            // empty: the edit has no name
  std::uint64_t content = 0;  // hash of the edit: another one of the same name is refused

  bool operator==(const EditKey&) const = default;
};
inline constexpr std::size_t kMaxEditKeyBytes = 128;
// So many edits are remembered by their keys: the last ones.
inline constexpr std::size_t kRememberedEdits = 4096;

// Digests that were made anew in part: those of all chunks through this one are right as of a commit.
struct DigestsMade {
  std::uint64_t commit = 0;  // 0: none
  ChunkId through;
  std::uint64_t frames = 0;  // in these chunks

  bool operator==(const DigestsMade&) const = default;
};

// All that must survive beside frames and sessions; it is written with every commit.
struct MapState : MapFacts {
  FrameSet pending;                // frames queued for relaxation (docs/method.md, 4), durable
  std::set<FrameId> lookups;       // frames that are applied but not looked up yet; the next start goes on with them
  std::uint32_t idle_records = 0;  // records of idle work since the last record that could cause some
  Extensions unknown;              // from a later version, kept unchanged
  // The commit as of which the stored digests are right (storage/graph/digest.h); 0: none. A program that knows nothing
  // of digests keeps the number, and commits: from then on it is not that of the last commit.
  std::uint64_t digests_commit = 0;
  DigestsMade digests_made = {};  // while they are being made; by its commit as believable as the number above
};

}  // namespace relmap::storage
