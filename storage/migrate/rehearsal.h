// A migration tried on a copy, so that it is known beforehand whether it succeeds, how long it takes and what room.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "storage/migrate/facts.h"
#include "storage/migrate/migrate.h"

namespace relmap::storage {

struct MigrationRehearsal {
  MigrateSummary migration;              // from == to: there is nothing to do, and nothing was copied
  std::string map;                       // the migrated copy, in the scratch folder
  double seconds = 0;                    // that the migration itself took
  std::uint64_t bytes = 0;               // that the new map takes beside the old one, without what the two share
  MapFactSums facts;                     // of the map as it is
  std::vector<std::string> differences;  // what the migrated map has otherwise, in words; empty: nothing
};

// `step` is "copying", "reading" or "migrating", with units done and their number (0: not known), in bytes or frames.
// If it returns a status other than OK, the rehearsal ends with that status.
using RehearsalProgress = std::function<Status(const char* step, std::uint64_t done, std::uint64_t total)>;

// Copies the map in `directory` into `scratch`, an empty folder, and migrates the copy. Nothing in `directory` is
// written, not even its lock. Where `scratch` is on the same file system, tables are shared. DISK_FULL, with the
// numbers, before anything is copied if there is no room; FOLDER_LOCKED if a process owns the map, unless it is of
// today's format; otherwise as migrate_folder().
Result<MigrationRehearsal> rehearse_migration(const std::string& directory, const std::string& scratch,
                                              const RehearsalProgress& progress);

}  // namespace relmap::storage
