// Brings a data folder of an older format to the one that this build reads.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "proto/base/status.h"

namespace relmap::storage {

struct MigrateSummary {
  int from = 0, to = 0;      // formats; equal: there was nothing to do
  std::uint64_t frames = 0;  // that were migrated
  std::string kept;          // folder with the map as it was; empty if there was nothing to do
};

// Whether this build can migrate a map of this format. UNKNOWN_FORMAT_VERSION.
Status check_migratable(const std::string& directory, int format);

// The new map is made in DIRECTORY.migrating, and changes places with the old one when it is whole and durable; the old
// one is kept as DIRECTORY.format-N. If interrupted at any moment, DIRECTORY is one of the two; another run starts
// over. From format 1 every frame is written anew, and estimates are rounded to the precision that is kept since
// (storage/graph/precision.h). Format 2 is read as it is: the map keeps its bytes, and shares its tables with the old
// one where the disk can.
//
// `progress` is called by this thread, with the frames done and the number of frames in the map.
//
// FOLDER_LOCKED, NO_SUCH_FILE, UNKNOWN_FORMAT_VERSION (a format that no release wrote, or a newer one), DATA_LOSS
// naming the part (repair it with the release that wrote it), IO_ERROR.
Result<MigrateSummary> migrate_folder(const std::string& directory,
                                      const std::function<void(std::uint64_t done, std::uint64_t total)>& progress);

}  // namespace relmap::storage
