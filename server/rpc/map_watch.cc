#include "server/rpc/map_watch.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "proto/base/overloaded.h"
#include "proto/wire/convert.h"
#include "server/rpc/event_messages.h"
#include "server/rpc/watch_token.h"

namespace relmap::rpc {

namespace {

v1::MapEvent storage_message(const Status& storage) {
  v1::MapEvent message;
  message.mutable_storage_changed()->set_reason(to_wire(storage.reason()));
  message.mutable_storage_changed()->set_message(storage.message());
  return message;
}

// Whether two frames that come one after another go into one message: they have the same author.
bool belong_together(const storage::Event& first, const storage::Event& next) {
  return std::holds_alternative<storage::FrameAddedEvent>(first.content) &&
         std::holds_alternative<storage::FrameAddedEvent>(next.content) &&
         first.submitted.author == next.submitted.author && first.note == next.note;
}

}  // namespace

MapWatch::MapWatch(const v1::WatchMapRequest& request, const MapIdentity& map, EventReader log, WatchFeed& feed)
    : map_(map),
      log_(std::move(log)),
      feed_(feed),
      sessions_(request.sessions().begin(), request.sessions().end()),
      no_frames_(request.no_frames()) {}

Result<std::shared_ptr<MapWatch>> MapWatch::begin(const v1::WatchMapRequest& request, const MapIdentity& map,
                                                  EventReader log, WatchFeed& feed) {
  if (!v1::WatchFrom_IsValid(request.from()))
    return Status(Reason::INVALID_ARGUMENT, "unknown beginning of a watch: " + std::to_string(request.from()));
  const std::shared_ptr<MapWatch> watch(new MapWatch(request, map, std::move(log), feed));
  const auto newest = watch->now();
  if (!newest.ok()) return newest.status();
  if (request.resume_token().empty()) {
    if (request.from() != v1::WATCH_FROM_OLDEST) watch->at_ = *newest;
    return watch;
  }
  const auto token = read_watch_token(request.resume_token());
  if (!token.ok()) return token.status();
  watch->at_ = token->at;
  if (token->map.uuid == map.uuid && token->map.epoch == map.epoch && token->at <= *newest) return watch;
  const std::string why = token->map.uuid != map.uuid
                              ? "the token is of another map"
                              : "the token is of this map before it was restored from a backup, or repaired";
  if (Status on = watch->go_on_from_now(Reason::WRONG_MAP, why + "; list again", 0); !on.ok()) return on;
  return watch;
}

// A position after all that is committed. It is never that before all events, so that what happens next is missed by
// nobody who goes on from here later.
Result<storage::EventPosition> MapWatch::now() const {
  const std::uint64_t committed = feed_.committed_sequence();
  const auto newest = log_.newest();
  if (!newest.ok()) return newest;
  return std::max(*newest, storage::EventPosition{committed, storage::kMovedOrdinal});
}

Status MapWatch::go_on_from_now(Reason reason, std::string message, std::uint64_t missed_after) {
  const auto newest = now();
  if (!newest.ok()) return newest.status();
  at_ = *newest;
  moved_ = true;
  v1::MapEvent& told = first_.emplace_back();
  v1::Resync& resync = *told.mutable_resync();
  resync.set_reason(to_wire(reason));
  resync.set_message(std::move(message));
  resync.set_missed_after(missed_after);
  resync.set_missed_before(at_.sequence + 1);
  feed_.count_resync();
  return {};
}

Result<Next<v1::MapEvent>> MapWatch::next(const Wake& wake, Clock::time_point now) {
  if (!subscription_) {
    heartbeat_ = now + kHeartbeat;
    subscription_ = feed_.subscribe(wake);
  }
  auto changes = subscription_->changes();
  if (!changes) return Next<v1::MapEvent>(Waiting{now + kHeartbeat});
  tell_changes(std::move(*changes));
  const bool may_read = first_.empty() && events_.empty();
  if (may_read && (more_ || read_commit_ != committed_.number))
    if (Status status = read(); !status.ok()) return status;
  if (!first_.empty()) {
    v1::MapEvent message = std::move(first_.front());
    first_.pop_front();
    message.set_resume_token(token());
    return Next<v1::MapEvent>(std::move(message));
  }
  while (!events_.empty()) {
    auto message = take_event();
    told();
    if (message) return Next<v1::MapEvent>(std::move(*message));
  }
  at_ = std::max(at_, through_);
  if (more_ || read_commit_ != committed_.number) return Next<v1::MapEvent>(Waiting{now});
  if (moved_ || now >= heartbeat_) return Next<v1::MapEvent>(caught_up(now));
  return Next<v1::MapEvent>(Waiting{heartbeat_});
}

void MapWatch::tell_changes(WatchFeed::Changes changes) {
  committed_ = changes.committed;
  if (changes.storage) first_.push_back(storage_message(*changes.storage));
  for (const auto& robot : changes.robots)
    if (robot->session() == 0 || wants(robot->session())) *first_.emplace_back().mutable_robot_changed() = *robot;
}

Status MapWatch::read() {
  auto read = log_.read(at_, kReadBytes);
  if (!read.ok()) return read.status();
  read_commit_ = committed_.number;
  more_ = read->more;
  if (read->gap) {
    more_ = true;
    return go_on_from_now(Reason::VIEW_EXPIRED,
                          "events were lost: they are too old, or this watcher is too slow; list again", at_.sequence);
  }
  through_ = read->through;
  events_.assign(std::make_move_iterator(read->events.begin()), std::make_move_iterator(read->events.end()));
  return {};
}

bool MapWatch::wants(const storage::EventContent& content) const {
  return std::visit(
      Overloaded{[&](const storage::SessionEvent& e) { return wants(e.session); },
                 [&](const storage::FrameAddedEvent& e) { return !no_frames_ && wants(e.frame.session); },
                 [&](const storage::SkippedEvent& e) { return !no_frames_ && wants(e.session); },
                 [&](const storage::FramesRemovedEvent& e) { return wants(e.session); },
                 [&](const storage::SessionDeletedEvent& e) { return wants(e.session); },
                 [&](const storage::ClosureEvent& e) { return wants(e.id.frame.session) || wants(e.a.session); },
                 // It does not say where the other end was.
                 [&](const storage::ClosureRemovedEvent&) { return true; },
                 [&](const storage::LabelsEvent& e) { return wants(e.frame.session); },
                 [&](const storage::FramesMovedEvent&) { return !no_frames_; }},
      content);
}

// Takes the first event, or several that go into one message; nullopt if the watcher does not want them.
std::optional<v1::MapEvent> MapWatch::take_event() {
  const storage::Event& event = events_.front();
  const bool wanted = wants(event.content);
  if (wanted && std::holds_alternative<storage::FrameAddedEvent>(event.content)) return take_frames();
  if (wanted && std::holds_alternative<storage::FramesMovedEvent>(event.content)) return take_moved();
  std::optional<v1::MapEvent> message;
  if (wanted) message = event_message(event);
  at_ = event.at;
  if (message) message->set_resume_token(token());
  if (message) feed_.count_told(1);
  events_.pop_front();
  return message;
}

v1::MapEvent MapWatch::take_frames() {
  v1::FramesAdded frames;
  for (;;) {
    const auto& frame = std::get<storage::FrameAddedEvent>(events_.front().content);
    if (wants(frame.frame.session)) *frames.add_frames() = added_frame_message(frame);
    const bool goes_on =
        frames.frames_size() < kMaxFrames && events_.size() > 1 && belong_together(events_[0], events_[1]);
    if (!goes_on) break;
    events_.pop_front();
  }
  v1::MapEvent message = event_message(events_.front());
  at_ = events_.front().at;
  feed_.count_told(static_cast<std::uint64_t>(frames.frames_size()));
  *message.mutable_frames_added() = std::move(frames);
  message.set_resume_token(token());
  events_.pop_front();
  return message;
}

// Frames moved, in several messages if they are many. All but the last have the token of the event before: who goes on
// from one of them is told all of them again.
std::optional<v1::MapEvent> MapWatch::take_moved() {
  const storage::Event& event = events_.front();
  const auto& ranges = std::get<storage::FramesMovedEvent>(event.content).ranges;
  v1::MapEvent message = event_message(event);
  v1::FramesMoved& moved = *message.mutable_frames_moved();
  for (; ranges_told_ < ranges.size() && moved.ranges_size() < kMaxFrames; ++ranges_told_) {
    const storage::FrameRange& range = ranges[ranges_told_];
    if (!wants(range.session)) continue;
    v1::FrameRange& added = *moved.add_ranges();
    added.set_session(range.session);
    added.set_first(range.first);
    added.set_last(range.last);
  }
  const bool tells = moved.ranges_size() > 0;
  if (ranges_told_ == ranges.size()) {
    at_ = event.at;
    ranges_told_ = 0;
    events_.pop_front();
    if (tells) feed_.count_told(1);
  }
  if (!tells) return {};
  message.set_resume_token(token());
  return message;
}

void MapWatch::told() {
  moved_ = true;
  subscription_->told_up_to(at_.sequence);
}

v1::MapEvent MapWatch::caught_up(Clock::time_point now) {
  moved_ = false;
  heartbeat_ = now + kHeartbeat;
  // Nothing else happened up to there, so whoever goes on later need not read it again.
  at_ = std::max(at_, storage::EventPosition{committed_.sequence, storage::kMovedOrdinal});
  subscription_->told_up_to(committed_.sequence);
  v1::MapEvent message;
  message.mutable_caught_up()->set_journal_sequence(committed_.sequence);
  message.mutable_caught_up()->set_time_us(committed_.time_us);
  message.set_resume_token(token());
  return message;
}

std::string MapWatch::token() const { return watch_token_text({map_, at_}); }

}  // namespace relmap::rpc
