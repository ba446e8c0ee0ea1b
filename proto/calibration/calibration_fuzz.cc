// For any text, every parser returns a plausible calibration or a reason.
#include <initializer_list>
#include <string_view>

#include "proto/base/testing/fuzzing.h"
#include "proto/calibration/calibration.h"
#include "proto/calibration/imu_calibration.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using fuzzing::must;
  const std::string_view text = fuzzing::text_of({data, size});
  const std::size_t half = text.find("\n====\n");  // two files, of EuRoC or ROS
  const std::string_view first = text.substr(0, half), second = half == text.npos ? text : text.substr(half + 6);
  for (const auto& c :
       {parse_kitti_calibration(text), parse_opencv_calibration(text), parse_euroc_calibration(first, second),
        parse_euroc_calibration(first), parse_kalibr_calibration(text), parse_ros_calibration(first, second),
        parse_ros_calibration(first)}) {
    if (!c.ok()) continue;
    must(c->check_plausible().ok());
    if (c->rectified) must(c->rectified_camera().is_stereo() != c->mono());
    if (c->mono()) continue;
    const StereoCalibration eye = c->right_eye();
    must(eye.mono() && eye.left == c->right && eye.check_plausible().ok());
  }
  const auto imu = parse_imu_calibration(text);
  if (imu.ok()) must(imu->gyro_noise > 0 && imu->T_body_imu.R.allFinite());
  return 0;
}
