// Selects the first pairs of a recording, or of a camera's stream, on which the eyes are checked (rig_check.h).
#pragma once

#include <cstdint>
#include <optional>

#include "frontend/capture/stereo_source.h"
#include "frontend/vision/rig_check.h"

namespace relmap::capture {

// Pairs are taken half a second apart, since neighbours show the same. Ten pairs with shared corners and four motions
// are enough: about 5 s of recording and half a second of computing. A robot may at first stand still or see nothing:
// without motion 20 pairs are taken, and without corners 40 (20 s), but no more. Not thread-safe.
class FirstPairs {
 public:
  // Pictures are rectified by `rectifier`, the one that tracking uses. It must outlive this object.
  explicit FirstPairs(const vision::Rectifier& rectifier)
      : rectifier_(rectifier), check_(rectifier.camera()), one_eyed_(rectifier.camera()) {}

  bool enough() const;
  // Whether a pair of that time should be given to take(). Callers copy raw pairs only then.
  bool wants(std::int64_t time_us) const;
  // The earliest time of the next pair that is wanted, for skip_before(); none if any pair is.
  std::optional<std::int64_t> next_us() const { return next_us_; }
  // Takes a pair. A pair that lacks an eye, is of another size, or is dark in both eyes is ignored.
  void take(StereoFrame raw);

  // The report on the pairs taken so far.
  vision::RigReport report();

 private:
  void look(vision::ImageView later);

  const vision::Rectifier& rectifier_;
  vision::RigCheck check_;
  // Pairs with a blind eye. They count only if there are no others, since a dead eye is always dead.
  vision::RigCheck one_eyed_;
  bool both_see_ = false;            // both eyes saw something in some pair
  std::optional<StereoFrame> held_;  // rectified; waits for the left picture of a moment later
  std::optional<std::int64_t> next_us_;
  int looked_ = 0, with_corners_ = 0;
};

// Checks the first pairs of a source that is at its beginning. Ends early if `stop` returns true.
template <typename Stop>
vision::RigReport check_first_pairs(StereoSource& source, const Stop& stop) {
  FirstPairs first(source.rectifier());
  while (!stop() && !first.enough()) {
    auto frame = source.next();
    if (!frame.ok()) continue;  // tracking will report it
    if (!frame->has_value()) break;
    if (!first.wants((*frame)->time_us)) continue;
    first.take(std::move(**frame));
    if (const auto next = first.next_us(); next && source.stamps_rise()) source.skip_before(*next);
  }
  return first.report();
}

}  // namespace relmap::capture
