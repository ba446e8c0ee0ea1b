// Counts the pairs of a run for its summary.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "frontend/capture/stereo_source.h"
#include "frontend/console.h"
#include "frontend/tracking/pipeline.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Adds `count` pictures or pairs that were left out: to summary.stamps_refused for TIME_BACKWARDS and TIME_AHEAD, and
// to summary.unreadable for any other reason.
void count_left_out(frontend::RunSummary& summary, Reason reason, std::uint64_t count = 1);

// Says why no pair could be tracked from another. If the stereo camera was found faulty (summary.rig), the reason is
// that of the first finding, such as NOT_STEREO; otherwise it is TOO_FEW_FEATURES. The message begins with `which` and
// the number of pairs given to the tracker: "none of 12 pairs could be tracked ...".
Status untracked(const frontend::RunSummary& summary, const std::string& which);

// Not thread-safe. The summary must outlive this.
class PairCounts {
 public:
  explicit PairCounts(frontend::RunSummary& summary) : summary_(summary) {}

  void add(const tracking::TrackedPair& pair);
  // Adds the counts of the pipeline. Must be called once, after the last pair.
  void add(const tracking::PipelineSummary& done);
  // Sets summary.expected, the number of pairs that there should have been, and summary.missing. If the source was read
  // to its end and knows how many pairs it has, all of these are expected, one in `every`, less those dropped to keep
  // up. Otherwise the pairs that the run reached are expected. Must be called after the others.
  void expect(const capture::StereoSource& source, std::size_t every, bool to_its_end);

 private:
  frontend::RunSummary& summary_;
  std::uint64_t one_came_ = 0;  // pairs given to the tracker of which only one picture came
  std::uint64_t left_out_ = 0;
};

}  // namespace relmap::workflow
