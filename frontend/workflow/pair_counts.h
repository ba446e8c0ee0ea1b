// What a run's summary says of the pairs that were tracked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "frontend/capture/stereo_source.h"
#include "frontend/console.h"
#include "frontend/tracking/pipeline.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Of a picture or pair that was left out; by its reason in one of the summary's two counts of them.
void count_left_out(frontend::RunSummary& summary, Reason reason, std::uint64_t count = 1);

// NOT_STEREO, ...: what is wrong with the eyes, else TOO_FEW_FEATURES. "WHICH 12 pairs could be tracked ...", of the
// pairs that were read.
Status untracked(const frontend::RunSummary& summary, const std::string& which);

// Not thread-safe; the summary must outlive it.
class PairCounts {
 public:
  explicit PairCounts(frontend::RunSummary& summary) : summary_(summary) {}

  void add(const tracking::TrackedPair& pair);
  // After the last one.
  void add(const tracking::PipelineSummary& done);
  // How many pairs there should have been: of those that `source` tells of every n-th where it was read to its end,
  // else those that were come to. After both others.
  void expect(const capture::StereoSource& source, std::size_t every, bool to_its_end);

 private:
  frontend::RunSummary& summary_;
  std::uint64_t one_came_ = 0;  // pairs tracked of which one picture did not come
  std::uint64_t left_out_ = 0;
};

}  // namespace relmap::workflow
