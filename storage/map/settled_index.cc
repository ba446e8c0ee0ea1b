#include "storage/map/settled_index.h"

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {

void visit_settled(const EngineSnapshot& snapshot, const SettledTable& since, SessionNumber session,
                   std::uint32_t sequence, const Graph::SettledVisit& visit) {
  bool going = true;
  const Status scanned = snapshot.scan_from(
      keys::settled_in(session), keys::settled(session, sequence), [&](std::string_view key, ByteSpan value) {
        const auto settled = decode_settled(value);
        if (!settled.ok() || keys::settled(session, settled->to) != key)
          throw StatusError(Status(Reason::DATA_LOSS, "what session " + std::to_string(session) +
                                                          " settled without a frame: " + settled.status().to_string()));
        return going = visit(*settled);
      });
  if (!scanned.ok()) throw StatusError(scanned);
  for (auto it = since.lower_bound({session, sequence}); going && it != since.end() && it->first.first == session; ++it)
    going = visit(it->second);
}

}  // namespace relmap::storage
