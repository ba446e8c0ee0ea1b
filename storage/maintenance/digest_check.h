// Compares the stored digests (storage/graph/digest.h) with the frames from which they follow, where the map says that
// they are right. A map whose digests were written before its last commit has them made anew by the next daemon, so
// nothing is wrong with it.
#pragma once

#include <cstdint>
#include <functional>

#include "storage/maintenance/chunk_table.h"
#include "storage/maintenance/finding.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/maintenance/stored_sessions.h"

namespace relmap::storage {

class DigestCheck {
 public:
  // `state`: as stored in the snapshot. `find` gets a finding with a frame of the chunk concerned, or none.
  DigestCheck(const EngineSnapshot& snapshot, const std::optional<MapState>& state, OnFinding find);

  // Compares the digests of a chunk with its frames. What is damaged of the frames is not compared.
  void check(const StoredPart<FrameHot>& part) const;
  // Finds digests of chunks that are not there, once `chunks` has all that are.
  void check_others(const ChunkTable& chunks) const;

 private:
  const EngineSnapshot& snapshot_;
  const bool right_;  // the map says that they are
  const OnFinding find_;
};

// The same for a whole map. Returns the number of findings. Throws StatusError: SHUTTING_DOWN if told to stop.
std::uint64_t check_digests(const EngineSnapshot& snapshot, const OnFinding& find, const OnProgress& on_progress);

}  // namespace relmap::storage
