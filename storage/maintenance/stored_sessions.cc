#include "storage/maintenance/stored_sessions.h"

#include <algorithm>
#include <set>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/map/pending_frames.h"

namespace relmap::storage {
namespace {

constexpr SessionNumber kBehind = 16;  // numbers that are tried behind the highest known one

SessionNumber number_in(std::string_view key) {
  SessionNumber number = 0;
  for (std::size_t i = 1; i < keys::kSessionKey; ++i) number = (number << 8) | static_cast<std::uint8_t>(key[i]);
  return number;
}

}  // namespace

StoredSessions load_sessions(const EngineSnapshot& snapshot) {
  StoredSessions all;
  const auto take = [&](std::string_view key, ByteSpan value, const Status& status) {
    const SessionNumber number = key.size() == keys::kSessionKey ? number_in(key) : 0;
    auto session = status.ok() ? decode_session(value) : Result<Session>(status);
    if (session.ok() && session->number == number && number != 0)
      all.sessions.push_back(std::move(*session));
    else
      all.damage.push_back({std::string(key), number,
                            "record of session " + std::to_string(number) + ": " +
                                (session.ok() ? "it is of another session" : session.status().to_string())});
  };
  std::set<SessionNumber> seen;
  const Status scanned = snapshot.scan(keys::all_sessions(), [&](std::string_view key, ByteSpan value) {
    if (key.size() == keys::kSessionKey) seen.insert(number_in(key));
    take(key, value, Status());
    return true;
  });
  // Numbers are given in order, so a record that is missing has a place among the others, or just behind them.
  SessionNumber max_number = seen.empty() ? 0 : *seen.rbegin();
  for (SessionNumber number = 1; number <= max_number + kBehind; ++number) {
    if (seen.contains(number)) continue;
    const std::string key = keys::session(number);
    const auto value = snapshot.get(key);
    const bool has_frames = has_parts(snapshot, Part::kHot, number);
    if (value.ok() && *value)
      take(key, **value, Status());
    else if (value.ok() && has_frames)
      all.unknown.push_back(number);
    else if (!value.ok() && (has_frames || number <= std::max(max_number, SessionNumber{1})))
      take(key, {}, value.status());
    else
      continue;
    max_number = std::max(max_number, number);
  }
  std::sort(all.sessions.begin(), all.sessions.end(),
            [](const Session& l, const Session& r) { return l.number < r.number; });
  if (!scanned.ok() && all.damage.empty() && all.unknown.empty())
    all.damage.push_back({"", 0, "records of sessions: " + scanned.to_string()});

  const Status queued = load_pending(snapshot, all.pending, [&](std::string_view key, const std::string& what) {
    all.pending_damage.push_back({std::string(key), what});
  });
  if (!queued.ok()) all.pending_damage.push_back({"", "frames that wait for relaxation: " + queued.to_string()});

  const auto state = snapshot.get(keys::map_state());
  if (!state.ok()) {
    all.state_damage = state.status().to_string();
  } else if (*state) {
    auto decoded = decode_state(**state);
    if (decoded.ok())
      all.state = std::move(*decoded);
    else
      all.state_damage = decoded.status().to_string();
  } else if (!all.sessions.empty()) {
    all.state_damage = "missing";
  }
  return all;
}

}  // namespace relmap::storage
