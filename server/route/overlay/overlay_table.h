// The table of the cells on disk, DIR/routes/table, which is written when a run of the daemon ends in order and removed
// when the next one begins. After a crash there is no table, and cells are made anew.
//
//    0  u8[8]  "RELMAPRT"
//    8  u32    version
//   12  u32    CRC32C of what follows
//   16  u64    number of the map's last commit (EngineSnapshot::commit_number)
//       stale chunks: u32 count, then session and chunk of each, u32
//       the overlay (Overlay::put)
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "server/route/overlay/overlay.h"

namespace relmap::route {

struct OverlayTable {
  Overlay overlay;
  std::vector<storage::ChunkId> stale;  // chunks that have changed since the cells were made
};

// Writes the table. The store of the overlay must not be written any more. `commit` is the number of the map's last
// commit. IO_ERROR, DISK_FULL: there is no table then.
Status write_table(const std::string& data_folder, std::uint64_t commit, const Overlay& overlay,
                   std::span<const storage::ChunkId> stale);

// Reads the table and removes it. nullopt if there is none, if it is of another commit or of other metrics, or if it is
// damaged. For `budget` and `room_for_others` see CellStore::open().
std::optional<OverlayTable> take_table(const std::string& data_folder, std::uint64_t commit,
                                       std::span<const RouteWeights> metrics, std::shared_ptr<storage::Budget> budget,
                                       std::uint64_t room_for_others);

}  // namespace relmap::route
