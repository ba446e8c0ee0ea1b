#include "tools/batch/batch.h"

#include <poll.h>

#include <algorithm>
#include <map>
#include <utility>

#include "proto/base/names.h"
#include "proto/base/number_text.h"

namespace relmap::batch {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kShowMs = 100;
constexpr int kMaxStarts = 2;  // of a recording whose front-end a signal ended, or that began in another map

// The daemon serves another map than before, or a restored one: the recording must be sent from its beginning.
bool in_another_map(Reason reason) { return reason == Reason::WRONG_MAP || reason == Reason::MAP_RESTORED; }

// The change in the number of photographs, which is all that is known of sessions that an older version made.
std::string change_of_number(const Sequence& sequence, const Summary& kept) {
  if (sequence.pictures == 0 || kept.json.empty()) return {};
  std::uint64_t taken = kept.pairs;
  for (const auto* refused : {&kept.unreadable, &kept.stamps_refused})
    for (const auto& [reason, count] : *refused) taken += count;
  if (taken == sequence.pictures) return {};
  return "is made of " + counted_text(taken, "picture") + ", and there are " + count_text(sequence.pictures) + " now";
}

// Whether the session holds the whole recording, as far as can be told without reading it.
bool holds_all(const client::Session& session, const Sequence& sequence, const Summary& summary) {
  // The session may be there by another part of a split log.
  if (!sequence.recorded.empty()) return session.next_sequence > sequence.last;
  if (session.state != client::SessionState::kFrozen) return true;
  const std::uint64_t settled = std::uint64_t{session.frames} + session.refused + session.given_up;
  return !summary.json.empty() && settled >= summary.keyframes;
}

}  // namespace

std::string change_since(const client::Session& session, const Sequence& sequence, bool photographs,
                         const Summary& kept) {
  std::string change;
  if (kept.recording && sequence.recording)
    change = change_text(*kept.recording, *sequence.recording, photographs);
  else if (!kept.recording)
    change = change_of_number(sequence, kept);
  return change.empty() ? "" : "session " + std::to_string(session.number) + ' ' + change;
}

Batch::Batch(BatchOptions options, const std::vector<Sequence>& sequences, const std::vector<client::Session>& known)
    : options_(std::move(options)), store_(options_.summaries, options_.map), running_(sequences.size()) {
  Known by_uuid;
  for (const client::Session& session : known) by_uuid[session.uuid] = &session;
  for (const Sequence& sequence : sequences) {
    Task& task = tasks_.emplace_back();
    task.sequence = sequence;
    const auto found = by_uuid.find(sequence.uuid.to_string());
    // The daemon refuses a session that is being deleted, and its message says what to do.
    if (found != by_uuid.end() && found->second->state != client::SessionState::kDeleting) judge(task, *found->second);
    if (!options_.recordings.again && (task.stage == Stage::kFailed || !task.begun_before))
      look_for_other(task, by_uuid);
    if (!sequence.readable && task.stage != Stage::kFailed) {
      task.stage = Stage::kFailed;
      task.failure = sequence.unlisted;
    }
  }
}

void Batch::refuse_changed(Task& task, const client::Session& session, const std::string& change) const {
  task.stage = Stage::kFailed;
  task.failure = {Reason::SEQUENCE_CONFLICT, change + advice(Reason::SEQUENCE_CONFLICT) + "; relmap session delete " +
                                                 std::to_string(session.number) + " removes the old session"};
}

// If --again has made another session of the recording, that session counts in place of its own one: the recording is
// in the map, or has changed since that session was made.
void Batch::look_for_other(Task& task, const Known& known) {
  const auto other = store_.other_of(task.sequence.uuid);
  const auto found = other ? known.find(other->to_string()) : known.end();
  if (found == known.end() || !task.sequence.recording) return;
  const client::Session& session = *found->second;
  Summary kept = store_.read(*other);
  if (!kept.recording || !holds_all(session, task.sequence, kept)) return;
  if (session.state != client::SessionState::kEnded && session.state != client::SessionState::kFrozen) return;
  const bool changed = kept.recording != task.sequence.recording;
  if (changed && task.stage == Stage::kFailed && task.failure.reason() != Reason::SEQUENCE_CONFLICT) return;
  task.summary = std::move(kept);
  task.sequence.uuid = *other;
  if (changed) {
    task.begun_before = true;
    return refuse_changed(task, session, change_since(session, task.sequence, options_.recordings.mono, task.summary));
  }
  task.stage = Stage::kWasThere;
  task.failure = {};
}

void Batch::judge(Task& task, const client::Session& session) {
  const Sequence& sequence = task.sequence;
  task.begun_before = true;
  Summary kept = store_.read(sequence.uuid);
  const std::string number = "session " + std::to_string(session.number);
  const auto fail = [&](Reason reason, const std::string& why) {
    task.stage = Stage::kFailed;
    task.failure = {reason, why};
  };
  if (const std::string change = change_since(session, sequence, options_.recordings.mono, kept); !change.empty()) {
    refuse_changed(task, session, change);
  } else if (session.state == client::SessionState::kOpen) {
    return;  // it goes on
  } else if (!holds_all(session, sequence, kept)) {
    if (session.state == client::SessionState::kFrozen)  // keyframes that it refuses would be settled for good
      fail(Reason::SESSION_FROZEN,
           number + " is frozen and may not hold the whole recording; after a thaw it can be completed" +
               advice(Reason::SESSION_FROZEN));
    return;
  } else if (kept.recording && !sequence.unlisted.ok()) {
    fail(sequence.unlisted.reason(),
         sequence.unlisted.message() + "; " + number + " was made of what was there before");
  } else {
    task.stage = Stage::kWasThere;
  }
  task.summary = std::move(kept);
}

void Batch::keep(const Status& status) {
  if (not_kept_.ok()) not_kept_ = status;
}

// How to take a recording in that its session refuses.
const char* Batch::advice(Reason reason) const {
  if (!options_.recordings.again) return "; --again takes it in as a new session";
  // After --again, the same command tries the same identity again, unless that has proved useless.
  return reason == Reason::SESSION_FROZEN ? "" : "; the same command takes it in as another new session";
}

std::vector<std::string> Batch::command(const Sequence& sequence) const {
  const RecordingOptions& how = options_.recordings;
  std::vector<std::string> command = {options_.program, "--source",      sequence.recorded.empty() ? how.source : "log",
                                      sequence.path,    "--to",          "grpc",
                                      "--server",       options_.server, "--spool",
                                      "none",           "--progress",    "json",
                                      "--quiet",        "--patience",    std::to_string(options_.patience_s)};
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) command.insert(command.end(), {option, value});
  };
  add("--credentials", options_.credentials);
  if (sequence.recorded.empty()) {
    add("--uuid", sequence.uuid.to_string());
    const std::string recorded = sequence.robot.empty() ? kUsualRobot : sequence.robot;
    add("--robot", how.robot.empty() ? recorded : how.robot);
    add("--session", sequence.session);
    add("--calibration", how.calibration);
    if (how.mono) command.push_back("--mono");
    if (options_.despite_check && !how.mono) command.push_back("--despite-check");
    add("--camera", sequence.camera);
  } else {
    add("--recorded", sequence.recorded);
    if (how.again)
      add("--uuid", sequence.uuid.to_string());
    else
      command.push_back("--as-recorded");
  }
  return command;
}

// Parts of one session are sent in order, since the daemon would take missing earlier keyframes for lost.
bool Batch::has_turn(const Task& task) const {
  return std::none_of(tasks_.begin(), tasks_.end(), [&](const Task& other) {
    return &other != &task && other.sequence.uuid == task.sequence.uuid &&
           (other.stage == Stage::kRunning ||
            (other.stage == Stage::kWaiting && other.sequence.first < task.sequence.first));
  });
}

void Batch::start_more() {
  auto busy = static_cast<std::size_t>(
      std::count_if(running_.begin(), running_.end(), [](const auto& front_end) { return front_end.has_value(); }));
  for (std::size_t i = 0; i < tasks_.size() && busy < options_.jobs; ++i) {
    Task& task = tasks_[i];
    if (task.stage != Stage::kWaiting || !has_turn(task)) continue;
    // Kept now: later it would not be known what the session was begun with.
    if (task.starts++ == 0 && task.sequence.recording && !task.begun_before)
      keep(store_.begin(task.sequence.uuid, *task.sequence.recording));
    task.begun = Clock::now();
    auto started = FrontEnd::start(command(task.sequence));
    if (!started.ok()) {
      task.stage = Stage::kFailed;
      task.failure = started.status();
      continue;
    }
    task.stage = Stage::kRunning;
    task.progress = {};
    running_[i] = std::move(*started);
    ++busy;
  }
}

void Batch::finish(std::size_t i) {
  Task& task = tasks_[i];
  const FrontEnd& front_end = *running_[i];
  task.summary = front_end.summary();
  task.failure = front_end.status();
  task.took = Clock::now() - task.begun;
  // A front-end that has sent everything before it hears of a refusal ends as if all were well.
  for (const auto& [reason, what] : {std::pair{Reason::SESSION_FROZEN, "the session was frozen"},
                                     {Reason::SESSION_DELETED, "the session was deleted from the map"},
                                     {Reason::SEQUENCE_CONFLICT, "the session has other keyframes already"}}) {
    // A log may hold several versions of a keyframe, of which the map has one.
    if (reason == Reason::SEQUENCE_CONFLICT && !task.sequence.recorded.empty()) continue;
    const auto refused = task.summary.refused.find(std::string(reason_name(reason)));
    if (task.failure.ok() && refused != task.summary.refused.end())
      task.failure = {reason, std::string(what) + ", and refused " + counted_text(refused->second, "keyframe")};
  }
  if (task.failure.ok()) {
    task.stage = Stage::kDone;
    keep(store_.done(task.sequence.uuid, task.summary));
    if (options_.recordings.again && task.sequence.recording)
      keep(store_.taken_in_as(uuid_of(task.sequence, options_.recordings), task.sequence.uuid));
  } else if (task.failure.reason() == Reason::SHUTTING_DOWN ||
             ((front_end.ended_by_signal() || in_another_map(task.failure.reason())) && task.starts < kMaxStarts)) {
    task.stage = Stage::kWaiting;
  } else {
    task.stage = Stage::kFailed;
    const Reason reason = task.failure.reason();
    if (reason == Reason::SESSION_DELETED)  // the front-end advises another session name, which cannot be given here
      task.failure = {reason, std::string("the session was deleted from the map") + advice(reason)};
    else if (reason == Reason::SESSION_FROZEN || reason == Reason::SEQUENCE_CONFLICT)
      task.failure = {reason, task.failure.message() + advice(reason)};
  }
  running_[i].reset();
}

bool Batch::run(const std::function<bool()>& stop, const std::function<void(const std::vector<Task>&)>& show) {
  bool stopping = false;
  for (;;) {
    if (!stopping && stop()) {
      stopping = true;
      for (auto& front_end : running_)
        if (front_end) front_end->interrupt();
    }
    if (!stopping) start_more();
    std::vector<pollfd> files;
    bool any = false;
    for (std::size_t i = 0; i < running_.size(); ++i) {
      if (!running_[i]) continue;
      const bool ended = running_[i]->take();
      tasks_[i].progress = running_[i]->progress();
      if (ended) {
        finish(i);
        any = true;
        continue;
      }
      any = true;
      for (const int file : {running_[i]->out(), running_[i]->err()})
        if (file >= 0) files.push_back({file, POLLIN, 0});
    }
    show(tasks_);
    if (!any) {
      const bool waiting =
          std::any_of(tasks_.begin(), tasks_.end(), [](const Task& task) { return task.stage == Stage::kWaiting; });
      if (stopping || !waiting) return !stopping;
      continue;
    }
    (void)::poll(files.data(), files.size(), kShowMs);
  }
}

}  // namespace relmap::batch
