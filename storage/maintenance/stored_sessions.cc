#include "storage/maintenance/stored_sessions.h"

#include <algorithm>
#include <optional>
#include <set>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/map/pending_frames.h"

namespace relmap::storage {
namespace {

constexpr SessionNumber kBehind = 16;  // numbers that are tried behind each known one

// The first session from `number` on that has a record or a frame, as far as the records can be read.
std::optional<SessionNumber> next_known(const EngineSnapshot& snapshot, SessionNumber number) {
  std::optional<SessionNumber> next;
  const auto consider = [&](std::optional<SessionNumber> found) {
    if (found && *found >= number) next = std::min(next.value_or(*found), *found);
    return false;
  };
  (void)snapshot.scan_from(keys::all_sessions(), keys::session(number),
                           [&](std::string_view key, ByteSpan) { return consider(keys::session_of(key)); });
  const std::string hot = keys::part(Part::kHot, {number, 0});
  (void)snapshot.scan_from(std::string_view(hot).substr(0, 1), hot, [&](std::string_view key, ByteSpan) {
    const auto part = keys::part_of(key);
    return consider(part ? std::optional(part->chunk.session) : std::nullopt);
  });
  return next;
}

}  // namespace

StoredSessions load_sessions(const EngineSnapshot& snapshot) {
  StoredSessions all;
  const auto take = [&](std::string_view key, ByteSpan value, const Status& status) {
    const SessionNumber number = keys::session_of(key).value_or(0);
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
    if (const auto number = keys::session_of(key)) seen.insert(*number);
    take(key, value, Status());
    return true;
  });
  // Numbers are given in order, so a record that is missing has a place just behind another session. Deleted sessions
  // leave gaps, and each restore leaves one of a million numbers, so gaps are passed over.
  SessionNumber max_number = seen.empty() ? 0 : *seen.rbegin();
  SessionNumber last_known = 0;
  for (SessionNumber number = 1; number != 0; ++number) {
    if (number - last_known > kBehind) {
      const auto next = next_known(snapshot, number);
      if (!next) break;
      number = *next;
    }
    if (seen.contains(number)) {
      last_known = number;
      continue;
    }
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
    last_known = number;
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
