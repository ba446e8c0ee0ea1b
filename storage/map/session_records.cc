#include "storage/map/session_records.h"

#include <algorithm>
#include <string>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {

namespace {

Session decoded(std::string_view key, ByteSpan value) {
  auto session = decode_session(value);
  if (session.ok() && keys::session(session->number) != key)
    session = Status(Reason::CORRUPT, "it is that of session " + std::to_string(session->number));
  if (!session.ok())
    throw StatusError(Status(Reason::DATA_LOSS, "the record of session " +
                                                    std::to_string(keys::session_of(key).value_or(0)) + ": " +
                                                    session.status().to_string()));
  return *std::move(session);
}

}  // namespace

SessionTable::const_iterator place_of(const SessionTable& table, SessionNumber number) {
  return std::lower_bound(table.begin(), table.end(), number,
                          [](const auto& entry, SessionNumber key) { return entry->number < key; });
}

std::shared_ptr<const Session> find_session(const SessionTable& table, SessionNumber number) {
  const auto it = place_of(table, number);
  return it != table.end() && (*it)->number == number ? *it : nullptr;
}

std::optional<Session> load_session(const EngineSnapshot& snapshot, SessionNumber number) {
  const std::string key = keys::session(number);
  const auto value = snapshot.get(key);
  throw_if(value.status());
  if (!*value) return std::nullopt;
  return decoded(key, **value);
}

void visit_sessions(const EngineSnapshot& snapshot, const SessionTable& table, SessionNumber from,
                    const Graph::SessionVisit& visit) {
  auto next = place_of(table, from);
  bool going = true;
  const Status scanned =
      snapshot.scan_from(keys::all_sessions(), keys::session(from), [&](std::string_view key, ByteSpan value) {
        const SessionNumber number = keys::session_of(key).value_or(0);
        while (going && next != table.end() && (*next)->number < number) going = visit(**next++);
        if (!going) return false;
        if (next != table.end() && (*next)->number == number)
          going = visit(**next++);
        else
          going = visit(decoded(key, value));
        return going;
      });
  throw_if(scanned);
  while (going && next != table.end()) going = visit(**next++);
}

}  // namespace relmap::storage
