#include "frontend/workflow/pair_reader.h"

#include <utility>

namespace relmap::workflow {

Result<std::optional<tracking::CapturedPair>> PairReader::next() {
  auto pair = read_ahead_ ? std::exchange(read_ahead_, {}) : read();
  if (pair.ok() && pair->has_value()) run_.pace.wait(run_.stop);
  return pair;
}

Result<std::optional<tracking::CapturedPair>> PairReader::read() {
  for (;;) {
    if (run_.stop) return std::optional<tracking::CapturedPair>();
    auto frame = source_.next();
    if (!frame.ok()) return frame.status();
    if (!frame->has_value()) return std::optional<tracking::CapturedPair>();
    if (read_++ % run_.options.every != 0) continue;
    if (seen_) seen_(**frame);
    capture::StereoFrame& pair = **frame;
    return std::optional(tracking::CapturedPair{std::move(pair.left), std::move(pair.right), pair.time_us,
                                                pair.eye_missing, pair.index, std::move(pair.picture), pair.arrived});
  }
}

tracking::StampFilter PairReader::go_on_at(std::int64_t time_us) {
  if (source_.stamps_rise()) {
    source_.skip_before(time_us);
    return tracking::StampFilter(time_us - 1);
  }
  // Where a clock was set, the offset of the stamps depends on all stamps before it. So they are filtered again.
  for (tracking::StampFilter stamps;;) {
    const tracking::StampFilter before = stamps;
    auto pair = read();
    if (!pair.ok()) continue;
    if (!pair->has_value()) return before;
    if (const auto moved_us = stamps.admit((*pair)->time_us); !moved_us.ok() || *moved_us < time_us) continue;
    read_ahead_ = std::move(*pair);
    return before;
  }
}

}  // namespace relmap::workflow
