// Runs front-ends over sequences, so many at once, until each is in the map or has failed.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "tools/batch/front_end.h"
#include "tools/batch/sequence.h"
#include "tools/batch/summary_store.h"

namespace relmap::batch {

struct BatchOptions {
  RecordingOptions recordings;
  std::string program = front_end_program();
  std::string server;  // as relmap-frontend takes it
  std::size_t jobs = 1;
  double patience_s = 60;      // of a front-end with a silent daemon
  bool despite_check = false;  // recordings are taken in though their eyes are plainly wrong
  std::string summaries;       // folder of what is kept beside the map (SummaryStore); empty: nothing is
  std::string map;             // which map the recordings go into; empty: not known
};

enum class Stage { kWaiting, kRunning, kDone, kWasThere, kFailed };

struct Task {
  Sequence sequence;
  Stage stage = Stage::kWaiting;
  Progress progress;
  Summary summary;
  Status failure;
  std::chrono::steady_clock::time_point begun;
  std::chrono::steady_clock::duration took{};
  int starts = 0;
  bool begun_before = false;  // the map has its session

  bool in_map() const { return stage == Stage::kDone || stage == Stage::kWasThere; }
  // In the map, and not to be trusted.
  bool untrusted() const { return in_map() && !summary.trusted; }
};

// How the recording differs from what the session that has its identity is made of, with that session's number; empty:
// it does not, or what the session is made of is not known.
std::string change_since(const client::Session& session, const Sequence& sequence, bool photographs,
                         const Summary& kept);

class Batch {
 public:
  // `known`: sessions of the map; those of the sequences that have ended are left out. Recordings that are not what
  // their sessions are made of fail (SEQUENCE_CONFLICT) before anything is sent, and so do those that cannot be read.
  Batch(BatchOptions options, const std::vector<Sequence>& sequences, const std::vector<client::Session>& known);

  // Until all are done or failed, or `stop` says so: then front-ends are asked to end, and what they had sent stays.
  // `show` is called several times a second. True unless it was stopped.
  bool run(const std::function<bool()>& stop, const std::function<void(const std::vector<Task>&)>& show);

  const std::vector<Task>& tasks() const { return tasks_; }
  // What could not be kept for a later run.
  const Status& not_kept() const { return not_kept_; }

  // What runs one of them.
  std::vector<std::string> command(const Sequence& sequence) const;

 private:
  bool has_turn(const Task& task) const;
  void start_more();
  void finish(std::size_t task);

  using Known = std::map<std::string, const client::Session*>;  // by uuid
  void judge(Task& task, const client::Session& session);
  void look_for_other(Task& task, const Known& known);
  void refuse_changed(Task& task, const client::Session& session, const std::string& change) const;
  void keep(const Status& status);
  const char* advice(Reason reason) const;

  const BatchOptions options_;
  const SummaryStore store_;
  Status not_kept_;
  std::vector<Task> tasks_;
  std::vector<std::optional<FrontEnd>> running_;  // by task
};

}  // namespace relmap::batch
