#include "server/map/deterministic_driver.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace relmap::map {

DeterministicDriver::DeterministicDriver(std::uint64_t slice, LookupQueue& lookups, Hooks hooks)
    : slice_(slice), lookups_(lookups), hooks_(std::move(hooks)) {}

DeterministicDriver::Outcome DeterministicDriver::follow_up(std::uint64_t sequence, std::optional<FrameId> frame,
                                                            int slices) {
  Outcome outcome{sequence, {}};
  try {
    if (frame) {
      lookups_.open(*frame);  // so that the next start repeats a lookup that does not finish
      const std::vector<storage::JournalRecord> found = hooks_.look_up(*frame);
      const auto follows = [&](const storage::JournalRecord& record) { return append_and_apply(record, outcome); };
      if (std::all_of(found.begin(), found.end(), follows)) lookups_.close(*frame);
    }
    relax(slices, outcome);
    while (const auto removal = hooks_.next_removal()) {
      if (!append_and_apply(*removal, outcome)) break;
      relax(kSlices, outcome);
    }
  } catch (const std::exception&) {
    outcome.trouble = caught_status();
  }
  return outcome;
}

bool DeterministicDriver::append_and_apply(const storage::JournalRecord& record, Outcome& outcome) {
  const auto appended = hooks_.append(record);
  if (!appended) return false;
  outcome.last = *appended;
  hooks_.apply(*appended, record);
  return true;
}

void DeterministicDriver::relax(int slices, Outcome& outcome) {
  for (int slice = 0; slice < slices && hooks_.relaxation_pending(); ++slice)
    if (!append_and_apply(storage::IdleWorkRecord{slice_}, outcome)) break;
}

}  // namespace relmap::map
