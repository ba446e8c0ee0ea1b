#include "frontend/workflow/pair_counts.h"

#include <algorithm>

#include "frontend/vision/rig_check.h"

namespace relmap::workflow {

void count_left_out(frontend::RunSummary& summary, Reason reason, std::uint64_t count) {
  const bool for_its_stamp = reason == Reason::TIME_BACKWARDS || reason == Reason::TIME_AHEAD;
  (for_its_stamp ? summary.stamps_refused : summary.unreadable)[reason] += count;
}

Status untracked(const frontend::RunSummary& summary, const std::string& which) {
  const std::string none = which + std::to_string(summary.pairs) + " pairs could be tracked from the one before it";
  if (summary.rig && summary.rig->wrong) {  // a faulty rig explains it
    const Status finding = vision::with_advice(summary.rig->findings.front());
    return {finding.reason(), none + ": " + finding.message()};
  }
  return {Reason::TOO_FEW_FEATURES, none + "; --show DIR draws what is seen"};
}

void PairCounts::add(const tracking::TrackedPair& pair) {
  const tracking::PairReport& report = pair.report;
  ++summary_.pairs;
  if (report.repeated)
    ++summary_.repeated;
  else if (report.tracked)
    ++summary_.tracked;
  else
    ++summary_.lost;
  summary_.one_eyed += report.one_eye && !report.repeated;
  summary_.seen += pair.both_came;
  summary_.measured += pair.both_came && report.tracked && !report.repeated;
  one_came_ += !pair.both_came;
  summary_.tracking_ms += pair.tracking_ms;
  summary_.offset_px = report.offset_px;
}

void PairCounts::add(const tracking::PipelineSummary& done) {
  summary_.dropped = done.dropped;
  for (const auto& [reason, count] : done.refused) {
    count_left_out(summary_, reason, count);
    left_out_ += count;
  }
  summary_.latency_p50_ms = done.keyframes.quantile(0.5);
  summary_.latency_p99_ms = done.keyframes.quantile(0.99);
  summary_.tracked_p50_ms = done.tracking.quantile(0.5);
  summary_.tracked_p99_ms = done.tracking.quantile(0.99);
}

void PairCounts::expect(const capture::StereoSource& source, std::size_t every, bool to_its_end) {
  summary_.missing = source.missing();
  const std::uint64_t told = (source.expected() + every - 1) / every;
  if (to_its_end && told > 0)
    summary_.expected = std::max(told, summary_.dropped) - summary_.dropped;  // dropped to keep up is not missing
  else  // if one picture of a pair came, the other is in left_out_
    summary_.expected = summary_.pairs + left_out_ - std::min(left_out_, one_came_);
}

}  // namespace relmap::workflow
