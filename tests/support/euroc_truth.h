// Where the camera of the recorded flight was (euroc_v101_keyframes100 of the data sets).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/support/drive_evaluation.h"

namespace relmap::testing {

// Rows of numbers below a line of names. A double holds nanoseconds of these years to a quarter of a microsecond.
std::vector<std::vector<double>> read_csv(const std::string& path);
std::int64_t euroc_microseconds(double ns);

// Poses of the rectified left camera in the room, at each picture; its truth is of the body. By time, microseconds.
std::map<std::int64_t, SE3> read_euroc_poses(const std::string& folder);
// Throws where there is none at that time.
const SE3& euroc_pose_at(const std::map<std::int64_t, SE3>& poses, std::int64_t time_us);
// The same since the first picture.
DriveTruth read_euroc_truth(const std::string& folder);

}  // namespace relmap::testing
