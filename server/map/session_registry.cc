#include "server/map/session_registry.h"

#include <future>
#include <utility>

#include "proto/keyframe/extension_codec.h"
#include "proto/keyframe/keyframe.h"
#include "storage/format/extension_tags.h"

namespace relmap::map {

SessionRegistry::SessionRegistry(std::shared_ptr<storage::Engine> engine, std::shared_ptr<storage::Budget> budget,
                                 CurrentView view, Journal journal, Health health)
    : engine_(std::move(engine)),
      budget_(std::move(budget)),
      view_(std::move(view)),
      journal_(std::move(journal)),
      health_(std::move(health)),
      thread_([this] { run(); }) {}

SessionRegistry::~SessionRegistry() {
  stop();
  const MutexLock lock(mutex_);
  budget_->release(storage::Share::kSessions, (index_.size() + beginning_.size()) * SessionIndex::bytes_each());
}

void SessionRegistry::load(std::uint64_t epoch, const storage::Graph& map) {
  const MutexLock lock(mutex_);
  epoch_ = epoch;
  map.visit_sessions(0, [this](const storage::Session& session) RELMAP_REQUIRES(mutex_) {
    index_.append(session.header, session.number);
    return true;
  });
  index_.sort();
  budget_->charge(storage::Share::kSessions, index_.size() * SessionIndex::bytes_each());
}

std::optional<SessionNumber> SessionRegistry::find(const SessionUuid& uuid) const {
  const MutexLock lock(mutex_);
  return index_.find(uuid);
}

void SessionRegistry::begin(const SessionHeader& header, Begun begun) {
  const Status health = health_();
  std::optional<SessionNumber> number;
  std::optional<SessionHeader> unseen;
  Status refused;
  {
    const MutexLock lock(mutex_);
    number = index_.find(header.uuid);
    if (number) {
      if (const auto at = unseen_.find(*number); at != unseen_.end()) unseen = at->second;
    } else if (const auto at = beginning_.find(header.uuid); at != beginning_.end()) {
      if (same_camera(at->second.header, header)) return at->second.waiting.push_back(std::move(begun));
      refused = {Reason::CALIBRATION_CHANGED, "session " + header.name + " is beginning with another camera or flags"};
    } else if (stopping_) {
      refused = {Reason::SHUTTING_DOWN, "the daemon is stopping"};
    } else if (!health.ok()) {
      refused = health;
    } else if (!budget_->try_charge(storage::Share::kSessions, SessionIndex::bytes_each())) {
      refused = {Reason::BUDGET_EXCEEDED,
                 "the map has " + std::to_string(index_.size()) + " sessions, as many as its memory budget allows"};
    } else {
      beginning_[header.uuid] = {header, 0, {std::move(begun)}};
      queue_.push(header.robot, header.uuid);
      return wake_.notify_one();
    }
  }
  begun(number ? known(header, *number, unseen) : Result<SessionNumber>(refused));
}

Result<SessionNumber> SessionRegistry::begin(const SessionHeader& header) {
  auto answer = std::make_shared<std::promise<Result<SessionNumber>>>();
  auto future = answer->get_future();
  begin(header, [answer](const Result<SessionNumber>& number) { answer->set_value(number); });
  return future.get();
}

// The answer where the session has begun.
Result<SessionNumber> SessionRegistry::known(const SessionHeader& header, SessionNumber number,
                                             const std::optional<SessionHeader>& unseen) const try {
  const auto now = view_()->session(number);
  if (now && storage::is_going(*now))
    return Status(Reason::SESSION_DELETED, "session " + now->display_name + " is deleted; begin a new session");
  const SessionHeader* const begun = now ? &now->header : unseen ? &*unseen : nullptr;
  if (!begun || same_camera(*begun, header)) return number;
  return Status(Reason::CALIBRATION_CHANGED, "session " + (now ? now->display_name : begun->name) +
                                                 " began with another camera or flags; begin a new session");
} catch (const StatusError& error) {
  return error.status();
}

void SessionRegistry::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    wake_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void SessionRegistry::run() {
  for (;;) {
    SessionUuid uuid;
    bool refuse = false;
    {
      MutexLock lock(mutex_);
      wake_.wait(mutex_, [this]() RELMAP_REQUIRES(mutex_) { return stopping_ || !queue_.empty(); });
      if (queue_.empty()) return;
      refuse = stopping_;
      uuid = queue_.pop();
    }
    if (refuse) {
      finish(uuid, {Reason::SHUTTING_DOWN, "the daemon is stopping"});
      continue;
    }
    forget_seen();
    if (const auto number = new_number(); number.ok())
      journal(uuid, *number);
    else
      finish(uuid, number.status());
  }
}

// A number that no session has. If the engine's counter was damaged and has gone back, its number may be in use.
Result<SessionNumber> SessionRegistry::new_number() try {
  if (unused_) return *std::exchange(unused_, std::nullopt);
  for (;;) {
    auto number = engine_->allocate_session(epoch_);
    if (!number.ok() || !view_()->session(*number)) return number;
  }
} catch (const StatusError& error) {
  return error.status();
}

void SessionRegistry::journal(const SessionUuid& uuid, SessionNumber number) {
  storage::SessionRecord record{number, {}, {}};
  {
    const MutexLock lock(mutex_);
    Beginning& session = beginning_.at(uuid);
    record.header = session.header;
    // When and by whom it was begun is not for a robot to say, and must not be taken for what the record says.
    for (const std::uint32_t tag : {storage::tags::kWallTime, storage::tags::kAuthor})
      (void)take_extension(record.header.unknown, tag);
    std::size_t namesakes = index_.namesakes(record.header);
    for (const auto& [other, beginning] : beginning_)
      namesakes += beginning.number != 0 && beginning.header.robot == record.header.robot &&
                   beginning.header.name == record.header.name;
    session.number = number;
    record.display_name = record.header.name;
    if (namesakes > 0) record.display_name += '#' + std::to_string(namesakes + 1);
  }
  const Status queued = journal_(
      std::move(record), [this, uuid](const Result<std::uint64_t>& written) { finish(uuid, written.status()); });
  if (queued.ok()) return;
  unused_ = number;
  finish(uuid, queued);
}

void SessionRegistry::finish(const SessionUuid& uuid, const Status& outcome) {
  Beginning session;
  {
    const MutexLock lock(mutex_);
    const auto at = beginning_.find(uuid);
    session = std::move(at->second);
    beginning_.erase(at);
    if (outcome.ok()) {
      index_.add(session.header, session.number);
      unseen_.emplace(session.number, session.header);
    } else {
      budget_->release(storage::Share::kSessions, SessionIndex::bytes_each());
    }
  }
  const auto answer = outcome.ok() ? Result<SessionNumber>(session.number) : Result<SessionNumber>(outcome);
  for (const Begun& begun : session.waiting) begun(answer);
}

// Of sessions that the map shows, the map tells everything.
void SessionRegistry::forget_seen() {
  const auto view = view_();
  for (;;) {
    SessionNumber oldest = 0;
    {
      const MutexLock lock(mutex_);
      if (unseen_.empty()) return;
      oldest = unseen_.begin()->first;
    }
    try {
      if (!view->session(oldest)) return;
    } catch (const StatusError&) {
      return;
    }
    const MutexLock lock(mutex_);
    unseen_.erase(oldest);
  }
}

}  // namespace relmap::map
