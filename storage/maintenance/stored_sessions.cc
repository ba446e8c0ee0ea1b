#include "storage/maintenance/stored_sessions.h"

#include <algorithm>

#include "storage/keys.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/state_codec.h"

namespace relmap {
namespace {

constexpr std::size_t kSessionKey = 5;

SessionNumber number_in(std::string_view key) {
  SessionNumber number = 0;
  for (std::size_t i = 1; i < kSessionKey; ++i) number = (number << 8) | static_cast<std::uint8_t>(key[i]);
  return number;
}

}  // namespace

StoredSessions load_sessions(const EngineSnapshot& snapshot) {
  StoredSessions all;
  const auto take = [&](std::string_view key, ByteSpan value, const Status& status) {
    const SessionNumber number = key.size() == kSessionKey ? number_in(key) : 0;
    auto session = status.ok() ? decode_session(value) : Result<Session>(status);
    if (session.ok() && session->number == number && number != 0)
      all.sessions.push_back(std::move(*session));
    else
      all.damage.push_back({std::string(key), number,
                            "record of session " + std::to_string(number) + ": " +
                                (session.ok() ? "it is of another session" : session.status().to_string())});
  };
  SessionNumber last = 0;
  const Status scanned = snapshot.scan(keys::all_sessions(), [&](std::string_view key, ByteSpan value) {
    if (key.size() == kSessionKey) last = number_in(key);
    take(key, value, Status());
    return true;
  });
  // Sessions that have frames, beside those that the scan has shown.
  std::vector<SessionNumber> with_frames;
  for (SessionNumber number = 0; (number = next_session_with(snapshot, Part::kHot, number)) != 0;)
    with_frames.push_back(number);
  if (!scanned.ok()) {  // it broke: records are tried one by one
    SessionNumber highest = with_frames.empty() ? last : std::max(last, with_frames.back());
    for (SessionNumber number = last + 1; number <= highest + 1; ++number) {
      const auto value = snapshot.get(keys::session(number));
      if (value.ok() && *value) {
        take(keys::session(number), **value, Status());
        highest = std::max(highest, number);
      } else if (!value.ok() && number <= highest) {
        take(keys::session(number), {}, value.status());
      }
    }
    if (all.damage.empty()) all.damage.push_back({"", 0, "records of sessions: " + scanned.to_string()});
  }
  for (const SessionNumber number : with_frames) {
    const auto is = [&](const auto& record) { return record.number == number; };
    if (std::none_of(all.sessions.begin(), all.sessions.end(), is) &&
        std::none_of(all.damage.begin(), all.damage.end(), is))
      all.unknown.push_back(number);
  }

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

}  // namespace relmap
