// Applies journal records to the map. Applying is a pure function of the map, the record and its sequence, so the same
// journal gives the same map bit for bit, whether the daemon was killed meanwhile or not. Work is counted, never timed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "server/map/closures.h"
#include "server/map/edge_changes.h"
#include "server/map/prepared_keyframe.h"
#include "server/rba/rba.h"
#include "storage/graph/frame.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"

namespace relmap::map {

struct Applied {
  std::optional<FrameId> frame;      // the frame that a keyframe became
  std::vector<std::uint32_t> words;  // of that frame
  ClosureChange closures;
  std::vector<EdgeChange> edges;  // only of records of closures: proposals, what was not seen, an operator's edits
  rba::RbaSummary relaxation;
  double relax_seconds = 0;  // wall clock, for statistics only
};

// For one thread, the worker.
class MapBuilder {
 public:
  // Maps that are kept use the defaults of `loop_edge_spacing` and `rules`; other values are for comparisons.
  MapBuilder(storage::Map& map, storage::WordFunction words, rba::RbaOptions rba,
             std::uint32_t loop_edge_spacing = kLoopEdgeSpacing, ConsistencyRules rules = {});

  // Applies the record, publishes the map, and records for the log of events what happened (event_teller.h). Publishing
  // rounds the estimates, so the next record finds the same map whether it follows at once or after a restart. A record
  // that no longer fits the map (for example a proposal for a frame that has been deleted) changes nothing. `prepared`:
  // what prepare() made of a keyframe's record; without it, it is made here.
  Applied apply(std::uint64_t sequence, const storage::JournalRecord& record,
                std::optional<PreparedKeyframe> prepared = {});

 private:
  Applied apply_record(std::uint64_t sequence, const storage::SessionRecord& record);
  Applied apply_keyframe(std::uint64_t sequence, const storage::KeyframeRecord& record, PreparedKeyframe prepared);
  Applied apply_record(std::uint64_t sequence, const storage::GapRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::RefusalRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::ClosureProposalRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::BindingRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::UnseenRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::SetEdgeStateRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::SetLabelRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::IdleWorkRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::SetSessionStateRecord& record);
  Applied apply_record(std::uint64_t sequence, const storage::RemoveChunkRecord& record);

  Applied relax_from(ClosureChange change);
  template <typename Edit>
  Applied recorded(Edit edit);
  static bool stands_still(const storage::Session& session);
  void freeze(const storage::Session& session);
  template <typename Work>
  void timed(Applied& applied, Work work);

  storage::Map& map_;
  storage::WordFunction words_;
  rba::Relaxer relaxer_;
  std::uint32_t loop_edge_spacing_;
  ConsistencyRules rules_;
};

}  // namespace relmap::map
