#include "server/map/session_registry.h"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/keyframe/extension_codec.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::map {

namespace {

// Memory of a session without its frames: in the map's tables, in its committed copy, and here.
std::size_t bytes_of(const storage::Session& session) {
  return 3 * (sizeof(storage::Session) + heap_bytes(session.header.unknown) + heap_bytes(session.unknown)) + 768;
}

}  // namespace

SessionRegistry::SessionRegistry(std::shared_ptr<storage::Engine> engine, std::shared_ptr<storage::Budget> budget,
                                 CurrentView view, Journal journal, Health health)
    : engine_(std::move(engine)),
      budget_(std::move(budget)),
      view_(std::move(view)),
      journal_(std::move(journal)),
      health_(std::move(health)) {}

SessionRegistry::~SessionRegistry() {
  for (const auto& [uuid, session] : sessions_) budget_->release(storage::Share::kSessions, bytes_of(session));
}

void SessionRegistry::load(std::uint64_t epoch, std::span<const storage::Session> sessions) {
  const MutexLock lock(mutex_);
  epoch_ = epoch;
  for (const storage::Session& session : sessions) sessions_.insert_or_assign(session.header.uuid, session);
  for (const auto& [uuid, session] : sessions_) budget_->charge(storage::Share::kSessions, bytes_of(session));
}

Result<SessionNumber> SessionRegistry::begin(const SessionHeader& header) {
  const MutexLock lock(mutex_);  // held through: one number for a uuid
  if (const auto known = sessions_.find(header.uuid); known != sessions_.end()) {
    const storage::Session& begun = known->second;
    if (const auto now = view_()->session(begun.number); now && storage::is_going(*now))
      return Status(Reason::SESSION_DELETED, "session " + begun.display_name + " is deleted; begin a new session");
    if (same_camera(begun.header, header)) return begun.number;
    return Status(Reason::CALIBRATION_CHANGED,
                  "session " + begun.display_name + " began with another camera or flags; begin a new session");
  }
  if (Status status = health_(); !status.ok()) return status;
  std::size_t namesakes = 0;
  for (const auto& [uuid, other] : sessions_)
    namesakes += other.header.robot == header.robot && other.header.name == header.name;
  storage::Session session;
  session.header = header;
  const std::size_t bytes = bytes_of(session);
  if (!budget_->try_charge(storage::Share::kSessions, bytes))
    return {Reason::BUDGET_EXCEEDED,
            "the map has " + std::to_string(sessions_.size()) + " sessions, as many as its memory budget allows"};
  const auto refused = [&](Status why) {
    budget_->release(storage::Share::kSessions, bytes);
    return why;
  };
  // If the engine's counter was damaged and has gone back, its number may be in use already.
  const auto taken = [&](SessionNumber number) RELMAP_REQUIRES(mutex_) {
    return std::any_of(sessions_.begin(), sessions_.end(),
                       [&](const auto& entry) { return entry.second.number == number; });
  };
  auto number = engine_->allocate_session(epoch_);
  while (number.ok() && taken(*number)) number = engine_->allocate_session(epoch_);
  if (!number.ok()) return refused(number.status());
  session.number = *number;
  session.display_name = namesakes == 0 ? header.name : header.name + '#' + std::to_string(namesakes + 1);
  auto journalled = journal_(storage::SessionRecord{session.number, session.display_name, header});
  if (!journalled.ok()) return refused(journalled.status());
  sessions_.emplace(header.uuid, session);
  return session.number;
}

}  // namespace relmap::map
