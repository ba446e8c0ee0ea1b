// What a map knows of itself beside its frames and sessions.
#pragma once

#include <array>
#include <cstdint>
#include <set>

#include "proto/base/ids.h"
#include "proto/base/map_identity.h"
#include "proto/keyframe/extensions.h"
#include "storage/graph/frame_set.h"

namespace relmap::storage {

// Of the map as a whole; every view has its own.
struct MapFacts {
  std::uint64_t applied_sequence = 0;
  std::array<std::uint64_t, 128> refused{};  // keyframes refused, by Reason
  std::uint64_t keyframes = 0;               // in the map
  std::uint64_t gaps = 0;                    // sequences given up
  std::uint64_t closures_accepted = 0;
  std::uint64_t closures_candidate = 0;
  std::uint64_t closures_quarantined = 0;
  std::uint64_t closures_removed = 0;
  std::uint64_t numerical_failures = 0;  // solves that left the map as it was
  std::uint32_t vocabulary_crc = 0;      // the vocabulary that the words were made with; 0: none yet
  MapIdentity identity;                  // not known: no daemon has served the map since maps have one
};

// What must survive beside frames and sessions: written with every commit.
struct MapState : MapFacts {
  FrameSet pending;                // frames queued for relaxation (docs/method.md, 4), durable
  std::set<FrameId> lookups;       // frames applied but not yet looked up beside the worker; taken up again at start
  std::uint32_t idle_records = 0;  // of idle work, applied since the last record that brought something
  Extensions unknown;              // of a later version: kept as they came
};

}  // namespace relmap::storage
