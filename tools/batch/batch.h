// Runs a front-end for each sequence, a limited number at a time, until each sequence is in the map or has failed.
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
  std::string server, credentials;  // of relmap-frontend
  std::size_t jobs = 1;
  double patience_s = 60;      // a front-end gives up after so long without progress of the daemon
  bool despite_check = false;  // take recordings in even if their stereo pair is plainly wrong
  std::string summaries;       // folder of the SummaryStore; empty: nothing is kept
  std::string map;             // uuid of the map that the recordings go into; empty: not known
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
  bool begun_before = false;  // the map had its session before this run

  bool in_map() const { return stage == Stage::kDone || stage == Stage::kWasThere; }
  // In the map, but not to be trusted (Summary::trusted).
  bool untrusted() const { return in_map() && !summary.trusted; }
};

// How the recording differs from what `session`, which has its identity, was made of; the text begins with the
// session's number. Empty if it does not differ, or if it is not known what the session was made of. `kept`: the
// summary that the SummaryStore has.
std::string change_since(const client::Session& session, const Sequence& sequence, bool photographs,
                         const Summary& kept);

class Batch {
 public:
  // `known`: the sessions of the map. Sequences whose sessions are there and have ended are left out. A recording that
  // has changed since its session was made fails (SEQUENCE_CONFLICT) before anything is sent, and so does one that
  // cannot be read.
  Batch(BatchOptions options, const std::vector<Sequence>& sequences, const std::vector<client::Session>& known);

  // Runs until all tasks are done or have failed, or `stop` returns true; then front-ends are asked to end, and what
  // they have sent stays in the map. `show` is called several times a second. Returns false if it was stopped.
  bool run(const std::function<bool()>& stop, const std::function<void(const std::vector<Task>&)>& show);

  const std::vector<Task>& tasks() const { return tasks_; }
  // Why something could not be kept in the SummaryStore; ok if everything was.
  const Status& not_kept() const { return not_kept_; }

  // The command line of the front-end for a sequence.
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
