#include "frontend/workflow/pair_outputs.h"

#include <utility>

#include "frontend/track_picture.h"

namespace relmap::workflow {

namespace {

constexpr double kFilmRate = 10;  // pairs a second, unless the options give a rate

}  // namespace

// Opens the report last, since opening may empty it.
Result<PairOutputs> PairOutputs::open(const RunOptions& options, bool goes_on) {
  PairOutputs outputs;
  if (!options.show.empty()) {
    auto show = frontend::open_track_show(options.show, options.rate_hz > 0 ? options.rate_hz : kFilmRate, goes_on);
    if (!show.ok()) return show.status();
    outputs.show_ = std::move(*show);
  }
  if (!options.report.empty()) {
    auto report = frontend::ReportFile::open(options.report, goes_on);
    if (!report.ok()) return report.status();
    outputs.report_.emplace(std::move(*report));
  }
  return outputs;
}

Status PairOutputs::add(const tracking::TrackedPair& pair) {
  if (report_) report_->add(pair);
  return show_ ? show_->show(frontend::draw_tracks(pair), pair.index) : Status();
}

Status PairOutputs::close() {
  Status report = report_ ? report_->close() : Status();
  Status show = show_ ? show_->close() : Status();
  return report.ok() ? show : report;
}

}  // namespace relmap::workflow
