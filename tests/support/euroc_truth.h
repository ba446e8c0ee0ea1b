// True poses of the camera of the recorded flight euroc_v101_keyframes100.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/support/drive_evaluation.h"

namespace relmap::testing {

// Rows of numbers below a header line. A double holds the nanoseconds of the time stamps to a quarter of a microsecond.
std::vector<std::vector<double>> read_csv(const std::string& path);
std::int64_t euroc_microseconds(double ns);

// T_room_left of the rectified left camera at each picture, by time in microseconds, computed from the body's truth.
std::map<std::int64_t, SE3> read_euroc_poses(const std::string& folder);
// Throws if there is no pose at that time.
const SE3& euroc_pose_at(const std::map<std::int64_t, SE3>& poses, std::int64_t time_us);
// The same poses by the time since the first picture.
DriveTruth read_euroc_truth(const std::string& folder);

}  // namespace relmap::testing
