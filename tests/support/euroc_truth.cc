#include "tests/support/euroc_truth.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "frontend/capture/stereo_source.h"
#include "tests/support/process.h"

namespace relmap::testing {

std::vector<std::vector<double>> read_csv(const std::string& path) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(read_text(path));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) rows.back().push_back(std::stod(field));
  }
  return rows;
}

std::int64_t euroc_microseconds(double ns) { return std::llround(ns / 1000); }

std::map<std::int64_t, SE3> read_euroc_poses(const std::string& folder) {
  const auto source = capture::open_euroc(folder).or_throw();
  const SE3 T_body_left =
      source->calibration().T_body_left * SE3{source->rectifier().left_rotation().transpose(), Vector3::Zero()};
  std::map<std::int64_t, SE3> poses;
  for (const std::vector<double>& row : read_csv(folder + "/gt_body.csv")) {
    const Eigen::Quaterniond turn(row.at(4), row.at(5), row.at(6), row.at(7));
    poses[euroc_microseconds(row.at(0))] =
        SE3{turn.normalized().toRotationMatrix(), Vector3(row.at(1), row.at(2), row.at(3))} * T_body_left;
  }
  return poses;
}

const SE3& euroc_pose_at(const std::map<std::int64_t, SE3>& poses, std::int64_t time_us) {
  const auto found = poses.lower_bound(time_us - 2);
  if (found == poses.end() || found->first > time_us + 2) throw std::runtime_error("no truth at that time");
  return found->second;
}

DriveTruth read_euroc_truth(const std::string& folder) {
  DriveTruth drive;
  const auto poses = read_euroc_poses(folder);
  for (const auto& [time_us, pose] : poses) {
    drive.time_us.push_back(time_us - poses.begin()->first);
    drive.poses.push_back(pose);
  }
  return drive;
}

}  // namespace relmap::testing
