#include "tools/batch/batch.h"

#include <poll.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "proto/usual_robot.h"

namespace relmap::batch {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kShowMs = 100;
constexpr int kMostStarts = 2;  // of a recording whose front-end was ended by a signal, or sent it to another map
constexpr const char* kAgain = "; --again takes it in as a new session";

std::string summary_path(const std::string& folder, const SessionUuid& uuid) {
  return folder + "/" + uuid.to_string() + ".json";
}

Summary stored_summary(const std::string& folder, const SessionUuid& uuid) {
  if (folder.empty()) return {};
  std::ifstream file(summary_path(folder, uuid));
  const std::string json{std::istreambuf_iterator<char>(file), {}};
  auto summary = read_summary(json);
  return summary.ok() ? std::move(*summary) : Summary();
}

void store_summary(const std::string& folder, const SessionUuid& uuid, const Summary& summary) {
  if (folder.empty() || summary.json.empty()) return;
  std::error_code error;  // only the report of a later run would miss it
  std::filesystem::create_directories(folder, error);
  std::ofstream(summary_path(folder, uuid)) << summary.json;
}

// The daemon serves another map than it did, or has lost what came after a backup: the recording begins anew.
bool in_another_map(Reason reason) { return reason == Reason::WRONG_MAP || reason == Reason::MAP_RESTORED; }

// Photographs were put into the folder, or taken out of it, since they became a session: their number tells.
Status check_unchanged(const client::Session& session, const Sequence& sequence, const Summary& summary) {
  if (sequence.pictures == 0 || summary.json.empty()) return {};
  std::uint64_t taken = summary.pairs;
  for (const auto* refused : {&summary.unreadable, &summary.stamps_refused})
    for (const auto& [reason, count] : *refused) taken += count;
  if (taken == sequence.pictures) return {};
  return {Reason::SEQUENCE_CONFLICT, "session " + std::to_string(session.number) + " is made of " +
                                         std::to_string(taken) + " pictures, and there are " +
                                         std::to_string(sequence.pictures) + " now" + kAgain};
}

// As far as can be told without reading the recording again.
bool holds_all(const client::Session& session, const Sequence& sequence, const Summary& summary) {
  // Of a log that was split another part may have been there.
  if (!sequence.recorded.empty()) return session.next_sequence > sequence.last;
  if (session.state != client::SessionState::kFrozen) return true;
  const std::uint64_t settled = std::uint64_t{session.frames} + session.refused + session.given_up;
  return !summary.json.empty() && settled >= summary.keyframes;
}

}  // namespace

Batch::Batch(BatchOptions options, const std::vector<Sequence>& sequences, const std::vector<client::Session>& known)
    : options_(std::move(options)), running_(sequences.size()) {
  std::map<std::string, const client::Session*> by_uuid;
  for (const client::Session& session : known) by_uuid[session.uuid] = &session;
  for (const Sequence& sequence : sequences) {
    Task& task = tasks_.emplace_back();
    task.sequence = sequence;
    const auto found = by_uuid.find(sequence.uuid.to_string());
    if (found == by_uuid.end()) continue;
    const client::Session& session = *found->second;
    // One that is being deleted is refused by the daemon, with how to take the recording in again.
    if (session.state == client::SessionState::kOpen || session.state == client::SessionState::kDeleting) continue;
    Summary summary = stored_summary(options_.summaries, sequence.uuid);
    if (holds_all(session, sequence, summary)) {
      task.failure = check_unchanged(session, sequence, summary);
      task.stage = task.failure.ok() ? Stage::kWasThere : Stage::kFailed;
      task.summary = std::move(summary);
    } else if (session.state == client::SessionState::kFrozen) {  // what it refuses would be settled for good
      task.stage = Stage::kFailed;
      task.failure = {Reason::SESSION_FROZEN,
                      "session " + std::to_string(session.number) +
                          " is frozen, and may not hold all of the recording; thawed, it goes on" + kAgain};
    }
  }
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
  if (sequence.recorded.empty()) {
    add("--uuid", sequence.uuid.to_string());
    add("--robot", how.robot.empty() ? kUsualRobot : how.robot);
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

// Parts of one session go in one after the other: what comes before must not be taken for lost.
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
    ++task.starts;
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
  // A front-end that had sent everything before it was told ends as if all were well.
  for (const Reason closed : {Reason::SESSION_FROZEN, Reason::SESSION_DELETED}) {
    const auto refused = task.summary.refused.find(std::string(reason_name(closed)));
    if (task.failure.ok() && refused != task.summary.refused.end())
      task.failure = {closed, std::string("the session was ") +
                                  (closed == Reason::SESSION_FROZEN ? "frozen" : "deleted from the map") +
                                  ", and refused " + std::to_string(refused->second) + " keyframes"};
  }
  if (task.failure.ok()) {
    task.stage = Stage::kDone;
    store_summary(options_.summaries, task.sequence.uuid, task.summary);
  } else if (task.failure.reason() == Reason::SHUTTING_DOWN ||
             ((front_end.ended_by_signal() || in_another_map(task.failure.reason())) && task.starts < kMostStarts)) {
    task.stage = Stage::kWaiting;
  } else {
    task.stage = Stage::kFailed;
    const Reason reason = task.failure.reason();
    if (reason == Reason::SESSION_DELETED || reason == Reason::SESSION_FROZEN)
      task.failure = {reason, task.failure.message() + kAgain};
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
