// Shows the progress of a batch: on a terminal a bar for each running recording and one for all; elsewhere a line every
// ten seconds. A finished recording gets a line in both.
#pragma once

#include <chrono>
#include <iosfwd>
#include <string>
#include <vector>

#include "tools/batch/batch.h"

namespace relmap::batch {

class BatchProgress {
 public:
  BatchProgress(std::ostream& err, bool terminal) : err_(err), terminal_(terminal) {}
  ~BatchProgress() { end(); }
  BatchProgress(const BatchProgress&) = delete;
  BatchProgress& operator=(const BatchProgress&) = delete;

  void show(const std::vector<Task>& tasks);
  // Erases the bars.
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  void tell_finished(const std::vector<Task>& tasks);
  std::string total(const std::vector<Task>& tasks) const;
  void erase();

  std::ostream& err_;
  const bool terminal_;
  const Clock::time_point begun_ = Clock::now();
  Clock::time_point shown_{};
  std::vector<Stage> stages_;
  std::size_t lines_ = 0;  // number of lines drawn
};

// How far all recordings together are. A finished recording counts with the pairs of its summary.
struct Extent {
  std::uint64_t pairs = 0;
  double share = 0;  // 0..1, of the recordings that this run takes in
};
Extent extent_of(const std::vector<Task>& tasks);

}  // namespace relmap::batch
