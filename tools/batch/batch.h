// Runs front-ends over sequences, so many at once, until each is in the map or has failed.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "tools/batch/front_end.h"
#include "tools/batch/sequence.h"

namespace relmap::batch {

struct BatchOptions {
  RecordingOptions recordings;
  std::string program = front_end_program();
  std::string server;  // as relmap-frontend takes it
  std::size_t jobs = 1;
  double patience_s = 60;      // of a front-end with a silent daemon
  bool despite_check = false;  // recordings are taken in though their eyes are plainly wrong
  std::string summaries;       // folder where front-ends' summaries are kept for the report; empty: none
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

  // In the map, and not to be trusted.
  bool untrusted() const { return (stage == Stage::kDone || stage == Stage::kWasThere) && !summary.trusted; }
};

class Batch {
 public:
  // `known`: sessions of the map; those of the sequences that have ended are left out.
  Batch(BatchOptions options, const std::vector<Sequence>& sequences, const std::vector<client::Session>& known);

  // Until all are done or failed, or `stop` says so: then front-ends are asked to end, and what they had sent stays.
  // `show` is called several times a second. True unless it was stopped.
  bool run(const std::function<bool()>& stop, const std::function<void(const std::vector<Task>&)>& show);

  const std::vector<Task>& tasks() const { return tasks_; }

  // What runs one of them.
  std::vector<std::string> command(const Sequence& sequence) const;

 private:
  bool has_turn(const Task& task) const;
  void start_more();
  void finish(std::size_t task);

  const BatchOptions options_;
  std::vector<Task> tasks_;
  std::vector<std::optional<FrontEnd>> running_;  // by task
};

}  // namespace relmap::batch
