#include "storage/map/skipped_index.h"

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {

void visit_skipped(const EngineSnapshot& snapshot, const SkippedTable& since, SessionNumber session,
                   std::uint32_t sequence, const Graph::SkippedVisit& visit) {
  bool going = true;
  const Status scanned = snapshot.scan_from(
      keys::skipped_in(session), keys::skipped(session, sequence), [&](std::string_view key, ByteSpan value) {
        const auto skipped = decode_skipped(value);
        if (!skipped.ok() || keys::skipped(session, skipped->to) != key)
          throw StatusError(Status(Reason::DATA_LOSS, "skipped sequences of session " + std::to_string(session) + ": " +
                                                          skipped.status().to_string()));
        return going = visit(*skipped);
      });
  if (!scanned.ok()) throw StatusError(scanned);
  for (auto it = since.lower_bound({session, sequence}); going && it != since.end() && it->first.first == session; ++it)
    going = visit(it->second);
}

}  // namespace relmap::storage
