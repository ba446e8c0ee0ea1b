// What came of a batch: a row for each recording.
#pragma once

#include <string>
#include <vector>

#include "tools/batch/batch.h"
#include "tools/batch/summary_store.h"
#include "tools/terminal/console.h"

namespace relmap::batch {

struct ReportRow {
  const Task* task = nullptr;
  SessionNumber session = 0;  // in the map; 0: it did not begin
  std::uint64_t keyframes = 0;
  std::uint64_t refused = 0, given_up = 0;
  std::uint64_t loops = 0;  // accepted, from its frames to older ones
  std::string doubt;        // why its camera's calibration is in doubt; empty: it is not

  // Keyframes that the daemon refused for good, of what is said to be in the map.
  std::uint64_t lost() const;
  // By itself (Task::untrusted()), or by what it contradicts.
  bool untrusted() const { return task->untrusted() || (task->in_map() && !doubt.empty()); }
};

// `sessions`, `loops` and `doubts` as the map has them now.
std::vector<ReportRow> report_rows(const std::vector<Task>& tasks, const std::vector<client::Session>& sessions,
                                   const std::vector<client::Edge>& loops,
                                   const std::vector<client::DoubtfulCamera>& doubts = {});

// A daemon forgets its doubts when it ends, and a recording that was not to be trusted is so still: what an earlier one
// said is said again, until the one that said it withdraws it. `boot`: of the daemon whose doubts the rows tell; empty:
// not known, and nothing is changed. IO_ERROR.
Status keep_doubts(const SummaryStore& store, const std::string& boot, std::vector<ReportRow>& rows);

void print_report(const std::vector<ReportRow>& rows, terminal::Console& console);
// {"sequences": [...], "frames": ..., "keyframes": ..., "failed": ..., "incomplete": ..., "untrusted": ...}
std::string report_json(const std::vector<ReportRow>& rows, double wall_s);

}  // namespace relmap::batch
