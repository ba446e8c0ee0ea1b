#include "server/place/stereo_pair.h"

#include "frontend/vision/exposure.h"
#include "frontend/vision/rig_check.h"

namespace relmap::place {

Status check_stereo_pair(vision::ImageView left, vision::ImageView right, const StereoCamera& camera) {
  constexpr double kMaxRowError = 2;  // pixels, in the median
  constexpr double kExchanged = -3;   // median disparity in pixels, which is never so negative in a pair
  if (vision::measure_exposure(left).blind()) return {Reason::EYE_DEAD, "the left picture shows nothing"};
  if (vision::same_picture(left, right)) return {Reason::NOT_STEREO, "both pictures are the same"};
  vision::RigCheck check(camera);
  if (!check.add(left, right).ok()) return {};  // too small to tell
  const vision::RigReport report = check.report();
  const Status wrong = report.what_is_wrong();
  const bool told = wrong.reason() == Reason::ROWS_APART   ? report.row_error > kMaxRowError
                    : wrong.reason() == Reason::NOT_STEREO ? report.disparity < kExchanged
                                                           : false;
  if (!told) return {};
  return {wrong.reason(),
          "the pictures are not a pair of this camera, or not of one moment: " + vision::with_advice(wrong).message()};
}

}  // namespace relmap::place
