#include "proto/geometry/camera.h"

#include "proto/base/refuse.h"

namespace relmap {

Status StereoCamera::check_plausible() const {
  const auto implausible = [](const auto&... parts) { return refuse(Reason::IMPLAUSIBLE_CALIBRATION, parts...); };
  if (!std::isfinite(f) || !std::isfinite(cx) || !std::isfinite(cy) || !std::isfinite(baseline))
    return implausible("f, cx, cy or baseline is not finite");
  if (width < 16 || width > 16384 || height < 16 || height > 16384)
    return implausible("picture of ", width, " x ", height, " pixels; a side must be 16..16384");
  if (f < 0.1 * width || f > 20.0 * width)
    return implausible("focal length of ", f, " px with a picture ", width, " px wide; must be 0.1..20 widths");
  if (cx < 0 || cx > width || cy < 0 || cy > height)
    return implausible("principal point (", cx, ", ", cy, ") outside the ", width, " x ", height, " picture");
  if (baseline != 0 && (baseline < 0.005 || baseline > 10))
    return implausible("baseline of ", baseline, " m; must be 0 (mono) or 0.005..10 m");
  return {};
}

}  // namespace relmap
