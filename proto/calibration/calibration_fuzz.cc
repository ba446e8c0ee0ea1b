// For any text, every parser returns a plausible calibration or a reason.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "proto/calibration/calibration.h"
#include "proto/calibration/imu_calibration.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t half = text.find("\n====\n");  // two files, of EuRoC or ROS
  const std::string_view first = text.substr(0, half), second = half == text.npos ? text : text.substr(half + 6);
  for (const auto& c : {relmap::parse_kitti_calibration(text), relmap::parse_opencv_calibration(text),
                        relmap::parse_euroc_calibration(first, second), relmap::parse_euroc_calibration(first),
                        relmap::parse_kalibr_calibration(text), relmap::parse_ros_calibration(first, second),
                        relmap::parse_ros_calibration(first)})
    if (c.ok() && !c->check_plausible().ok()) std::abort();
  const auto imu = relmap::parse_imu_calibration(text);
  if (imu.ok() && !(imu->gyro_noise > 0 && imu->T_body_imu.R.allFinite())) std::abort();
  return 0;
}
