// What is known of the cells on disk from one run of the daemon to the next: DIR/routes/table, written when a run ends
// in order, and taken away when the next begins. After a crash cells are made anew.
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
  std::vector<storage::ChunkId> stale;  // changed since the cells were made
};

// Nothing is written any more to the store of the overlay. `commit`: the map as it is now. IO_ERROR, DISK_FULL: there
// is no table then.
Status write_table(const std::string& data_folder, std::uint64_t commit, const Overlay& overlay,
                   std::span<const storage::ChunkId> stale);

// Takes it away; for the last two see CellStore::open(). Nullopt: there is none, or it is not of this commit and these
// metrics, or not whole.
std::optional<OverlayTable> take_table(const std::string& data_folder, std::uint64_t commit,
                                       std::span<const RouteWeights> metrics, std::shared_ptr<storage::Budget> budget,
                                       std::uint64_t room_for_others);

}  // namespace relmap::route
