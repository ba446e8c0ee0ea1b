// The report of a batch: a row for each recording.
#pragma once

#include <string>
#include <vector>

#include "tools/batch/batch.h"
#include "tools/batch/summary_store.h"
#include "tools/terminal/console.h"

namespace relmap::batch {

struct ReportRow {
  const Task* task = nullptr;
  SessionNumber session = 0;  // in the map; 0: the session did not begin
  std::uint64_t keyframes = 0;
  std::uint64_t refused = 0, given_up = 0;
  std::uint64_t loops = 0;  // accepted closures from its frames to older ones
  std::string doubt;        // why the map doubts the camera's calibration; empty: it does not

  // Keyframes that the daemon refused for good, if the recording counts as in the map; else 0.
  std::uint64_t lost() const;
  // Whether the recording cannot be trusted: by its summary, or since the map doubts its calibration.
  bool untrusted() const { return task->untrusted() || (task->in_map() && !doubt.empty()); }
};

// `sessions`, `loops` and `doubts` are those of the map after the batch.
std::vector<ReportRow> report_rows(const std::vector<Task>& tasks, const std::vector<client::Session>& sessions,
                                   const std::vector<client::Edge>& loops,
                                   const std::vector<client::DoubtfulCamera>& doubts = {});

// Keeps the doubts of the rows in the store, and adds those that an earlier daemon had: a daemon forgets its doubts
// when it ends, but the recording still cannot be trusted. A doubt is dropped only when the daemon that had it
// withdraws it. `boot`: boot id of the daemon whose doubts the rows have; empty: not known, and nothing is changed.
// IO_ERROR.
Status keep_doubts(const SummaryStore& store, const std::string& boot, std::vector<ReportRow>& rows);

void print_report(const std::vector<ReportRow>& rows, terminal::Console& console);
// {"sequences": [...], "frames": ..., "keyframes": ..., "failed": ..., "incomplete": ..., "untrusted": ...}
std::string report_json(const std::vector<ReportRow>& rows, double wall_s);

}  // namespace relmap::batch
