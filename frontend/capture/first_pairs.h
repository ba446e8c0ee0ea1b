// The pairs at the beginning of a recording, or of a camera's stream, on which its eyes are checked (rig_check.h).
#pragma once

#include <cstdint>
#include <optional>

#include "frontend/capture/stereo_source.h"
#include "frontend/vision/rig_check.h"

namespace relmap::capture {

// Which pairs are looked at follows from what they show. Half a second apart, since neighbours show the same; ten that
// share corners, and four motions, are plenty: some 5 s and half a second of work. A robot may stand, or see nothing,
// at first: without corners 40 are looked at, 20 s; without motion 20. What has not shown by then is not waited for.
// Not thread-safe.
class FirstPairs {
 public:
  // Of that rectifier, which must outlive it: the pictures that are tracked.
  explicit FirstPairs(const vision::Rectifier& rectifier)
      : rectifier_(rectifier), check_(rectifier.camera()), one_eyed_(rectifier.camera()) {}

  bool enough() const;
  // Whether a pair of that time is to be given to take(); raw pairs are copied for it only then.
  bool wants(std::int64_t time_us) const;
  // The time of the first pair after those taken that it wants, for skip_before(); none: any.
  std::optional<std::int64_t> next_us() const { return next_us_; }
  // A pair without one of its eyes tells nothing, nor one of another size, nor one in the dark.
  void take(StereoFrame raw);

  // Of those taken so far.
  vision::RigReport report();

 private:
  void look(vision::ImageView later);

  const vision::Rectifier& rectifier_;
  vision::RigCheck check_;
  // Of pairs with a blind eye: they count if there are no others, for a dead eye is dead at all times.
  vision::RigCheck one_eyed_;
  bool both_see_ = false;            // of some pair
  std::optional<StereoFrame> held_;  // rectified; waits for what its left eye sees a moment later
  std::optional<std::int64_t> next_us_;
  int looked_ = 0, with_corners_ = 0;
};

// Takes what it wants from a source that is at its beginning, until there is enough or `stop` says so.
template <typename Stop>
vision::RigReport check_first_pairs(StereoSource& source, const Stop& stop) {
  FirstPairs first(source.rectifier());
  while (!stop() && !first.enough()) {
    auto frame = source.next();
    if (!frame.ok()) continue;  // whoever tracks will say so
    if (!frame->has_value()) break;
    if (!first.wants((*frame)->time_us)) continue;
    first.take(std::move(**frame));
    if (const auto next = first.next_us(); next && source.stamps_rise()) source.skip_before(*next);
  }
  return first.report();
}

}  // namespace relmap::capture
