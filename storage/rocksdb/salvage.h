// Saves what can still be read of a RocksDB folder whose own files are damaged, truncated or missing.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "storage/graph/frame.h"
#include "storage/maintenance/finding.h"

namespace relmap::storage {

struct SalvageResult {
  bool sound = false;        // everything could be read: no copy was made
  std::uint64_t copied = 0;  // keys
  std::uint64_t lost = 0;    // keys that are known to have been there
};

// Reads all of the store in `map`, which no process may have open. Unless all of it can be read, makes a new store
// `copy` with everything that can; it is complete and durable on return. `copy` must not exist; `work` is a scratch
// folder beside it. Nothing in `map` is changed. DATA_LOSS if nothing can be saved, IO_ERROR.
Result<SalvageResult> salvage_store(const std::string& map, const std::string& work, const std::string& copy,
                                    const OnFinding& on_finding, const OnProgress& on_progress);

// What the repair of the journal has to know of a readable store: how far it goes.
struct StoreHead {
  std::uint64_t applied = 0;
  std::vector<Session> sessions;
};
Result<StoreHead> read_store_head(const std::string& map);

}  // namespace relmap::storage
