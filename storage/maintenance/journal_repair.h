// Repair of the journal's files: makes a copy in which every record is whole. Records that were durable and cannot be
// read are replaced one for one, so that all records behind them can still be applied: by the gap that they leave in
// each session whose keyframes are missing, by a session's record as its keyframes repeat it, and otherwise by a record
// that does nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "storage/graph/frame.h"
#include "storage/io/file.h"
#include "storage/maintenance/finding.h"
#include "storage/maintenance/repair.h"

namespace relmap::storage {

struct JournalCopy {
  bool sound = true;              // nothing was lost: the journal can stay as it is, and no copy was made
  std::vector<RecordRange> lost;  // records that were replaced
  std::uint64_t last = 0;         // sequence of the last record
};

// Reads the segments in `from` and, unless they are sound, writes `to`, which must not exist. `applied`: records up to
// it are in the map and do not matter. `sessions`: as the map has them at `applied`. IO_ERROR.
Result<JournalCopy> repair_journal(const std::shared_ptr<FileSystem>& files, const std::string& from,
                                   const std::string& to, std::uint64_t applied, const std::vector<Session>& sessions,
                                   const OnFinding& on_finding, const OnProgress& on_progress);

}  // namespace relmap::storage
