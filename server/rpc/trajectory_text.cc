#include "server/rpc/trajectory_text.h"

#include <cmath>
#include <cstdio>

#include "proto/keyframe/motion_source_name.h"
#include "storage/graph/frame.h"

namespace relmap::rpc {

namespace {

std::string doubt(const storage::Edge& step) {
  const std::string way = step.a.to_string() + " to " + step.b.to_string();
  if (!step.carried_by.empty())
    return "# carried: " + way + ", according to closure " + step.carried_by.front().to_string() +
           "; the odometry did not notice it\n";
  char sigma[32];
  std::snprintf(sigma, sizeof sigma, "%.2g", std::sqrt(step.covariance.topLeftCorner<3, 3>().trace() / 3));
  return "# not measured: " + way + " (" +
         (step.reason == Reason::DECLARED_GAP ? std::string("gap") : name_of(step.source)) + ", sigma " + sigma +
         " m)\n";
}

}  // namespace

std::string trajectory_header(TrajectoryFormat format, const storage::Session& session) {
  if (format == TrajectoryFormat::kKitti) return {};
  const FrameId first{session.number, session.first};
  return "# relmap session " + session.header.uuid.to_string() + " (" + session.display_name + ")\n" +
         "# poses in the frame of keyframe " + first.to_string() +
         " (its rectified left camera: x right, y down, z forward; metres)\n"
         "# chained along the session's odometry edges, as the map has refined them; time UTC in seconds: "
         "time tx ty tz qx qy qz qw\n";
}

std::string trajectory_line(TrajectoryFormat format, const route::TrajectoryPose& pose) {
  const SE3& T = pose.T_first_frame;
  char line[512];
  if (format == TrajectoryFormat::kTum) {
    const Eigen::Quaterniond q = T.quaternion();
    const auto time_us = static_cast<long long>(pose.hot->time_us);
    std::snprintf(line, sizeof line, "%lld.%06lld %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", time_us / 1000000,
                  time_us % 1000000, T.t.x(), T.t.y(), T.t.z(), q.x(), q.y(), q.z(), q.w());
    if (pose.doubtful_step) return doubt(*pose.doubtful_step) + line;
  } else {
    const Matrix3& R = T.R;
    std::snprintf(line, sizeof line, "%.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", R(0, 0), R(0, 1),
                  R(0, 2), T.t.x(), R(1, 0), R(1, 1), R(1, 2), T.t.y(), R(2, 0), R(2, 1), R(2, 2), T.t.z());
  }
  return line;
}

}  // namespace relmap::rpc
