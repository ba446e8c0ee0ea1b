#include "storage/events/event_head.h"

#include "storage/format/keys.h"

namespace relmap::storage {

Result<std::optional<EventLogHead>> load_event_head(const EngineSnapshot& snapshot) {
  const auto bytes = snapshot.get(keys::all_events());
  if (!bytes.ok()) return bytes.status();
  if (!*bytes) return std::optional<EventLogHead>();
  const auto head = decode_event_head(**bytes);
  if (!head.ok()) return head.status();
  return std::optional(*head);
}

}  // namespace relmap::storage
