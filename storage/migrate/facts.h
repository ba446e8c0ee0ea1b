// What a map holds that a migration must not change, counted and summed up in the same way for every format. What is
// derived from it, and is computed anew by a migration, has no part in it.
#pragma once

#include <cstdint>
#include <functional>

#include "proto/base/status.h"
#include "storage/engine/engine.h"

namespace relmap::storage {

struct MapFactSums {
  std::uint64_t sessions = 0, frames = 0, edges = 0, landmarks = 0, observations = 0, features = 0;
  std::uint64_t labels = 0;           // of frames
  std::uint64_t journal_records = 0;  // that the map does not contain yet
  std::uint64_t hash = 0;             // of all facts, down to each number; estimates to the precision of today's format

  bool operator==(const MapFactSums&) const = default;
};

// `engine` has opened a folder of this format. `progress` is called with the frames done; if it returns a status other
// than OK, that is the result. DATA_LOSS naming what cannot be read.
Result<MapFactSums> sum_facts(const Engine& engine, int format,
                              const std::function<Status(std::uint64_t frames)>& progress);

}  // namespace relmap::storage
