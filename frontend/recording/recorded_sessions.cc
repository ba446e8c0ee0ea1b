#include "frontend/recording/recorded_sessions.h"

#include <algorithm>
#include <map>
#include <utility>

#include "frontend/recording/keyframe_assembler.h"
#include "proto/base/names.h"
#include "proto/wire/channels.h"

namespace relmap::recording {

namespace {

constexpr std::size_t kMaxSessions = 1000;

// The header, as soon as a keyframe of the session is complete.
class Census {
 public:
  Status take(const KeyframePart& part) {
    const auto [index, is_new] = index_.emplace(part.session, sessions_.size());
    if (is_new && sessions_.size() == kMaxSessions)
      return {Reason::BUDGET_EXCEEDED, "more than " + std::to_string(kMaxSessions) + " sessions"};
    if (is_new) sessions_.push_back({{}, part.sequence, part.sequence});
    RecordedSession& session = sessions_[index->second];
    session.first = std::min(session.first, part.sequence);
    session.last = std::max(session.last, part.sequence);
    return session.header.uuid.is_nil() ? find_header(session, part) : Status();
  }

  std::vector<RecordedSession> whole() && {
    std::erase_if(sessions_, [](const RecordedSession& session) { return session.header.uuid.is_nil(); });
    return std::move(sessions_);
  }

 private:
  Status find_header(RecordedSession& session, const KeyframePart& part) {
    const auto payload = assembler_.add(part);
    if (!payload.ok() || !payload->has_value()) return payload.status();
    auto keyframe = decode_keyframe(**payload);
    if (!keyframe.ok()) return keyframe.status();
    if (keyframe->session.uuid != part.session)
      return {Reason::CORRUPT, "a keyframe of another session than its parts say"};
    session.header = std::move(keyframe->session);
    return {};
  }

  std::map<SessionUuid, std::size_t> index_;
  std::vector<RecordedSession> sessions_;
  KeyframeAssembler assembler_;
};

// Removes control characters, so that a log cannot control a terminal.
std::string printable(const std::string& name) { return check_name("name", name).ok() ? name : "(no name)"; }

std::string describe(const std::vector<RecordedSession>& sessions) {
  std::string text;
  for (const RecordedSession& s : sessions)
    text += "\n  " + s.header.uuid.to_string() + "  " + printable(s.header.robot) + ", " + printable(s.header.name) +
            ": keyframes " + std::to_string(s.first) + " to " + std::to_string(s.last);
  return text;
}

}  // namespace

Result<std::vector<RecordedSession>> list_sessions(EventLog& log) {
  Census census;
  Status refused;  // the first refusal
  auto event = log.next();
  for (; event.ok() && event->has_value(); event = log.next()) {
    if ((*event)->channel != kKeyframeChannel) continue;
    const auto part = read_part(log.data(**event));
    const Status status = part.ok() ? census.take(*part) : part.status();
    if (status.reason() == Reason::BUDGET_EXCEEDED) return {status.reason(), log.name() + " holds " + status.message()};
    if (refused.ok()) refused = status;
  }
  log.rewind();
  auto sessions = std::move(census).whole();
  if (!sessions.empty()) return sessions;
  if (!event.ok()) return event.status();
  if (!refused.ok())
    return {refused.reason(), log.name() + " holds no whole keyframe; the first: " + refused.message()};
  return {Reason::BAD_SIZE, log.name() + " holds no whole keyframe"};
}

Result<RecordedSession> choose_session(const std::string& log_name, const std::vector<RecordedSession>& sessions,
                                       const std::string& choice) {
  const auto uuid = SessionUuid::parse(choice);
  const auto chosen = [&](const RecordedSession& s) {
    return choice.empty() || s.header.name == choice || s.header.uuid == uuid;
  };
  const auto first = std::find_if(sessions.begin(), sessions.end(), chosen);
  if (first == sessions.end())
    return {Reason::NO_SUCH_SESSION, log_name + " holds no session " + choice + "; it holds" + describe(sessions)};
  if (std::find_if(first + 1, sessions.end(), chosen) != sessions.end())
    return {Reason::INVALID_ARGUMENT,
            log_name + " holds several sessions; choose one by its uuid or name" + describe(sessions)};
  return *first;
}

}  // namespace relmap::recording
