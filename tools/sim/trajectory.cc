#include "tools/sim/trajectory.h"

#include <cmath>

namespace relmap::sim {
namespace {

// Long enough that the circuit's table, which is linear between its entries, does not show in second differences;
// short against the shortest waves of a drive.
constexpr double kDifference = 0.015;  // seconds

}  // namespace

Trajectory::Trajectory(const PictureWorldOptions& o, const Circuit& circuit)
    : options_(o),
      circuit_(circuit),
      lateral_(Random(o.seed, 11), 13, 47),
      heading_(Random(o.seed, 12), 9, 31),
      pitch_(Random(o.seed, 13), 5, 17),
      roll_(Random(o.seed, 14), 6, 23),
      bounce_(Random(o.seed, 15), 4, 11),
      speed_(Random(o.seed, 16), 15, 40) {}

double Trajectory::distance(double frame) const { return options_.step * frame + speed_.at(options_.step * frame); }

SE3 Trajectory::pose(double frame) const {
  const double s = distance(frame), small = 0.01;
  const auto place = [&](double at) { return circuit_.beside(at, options_.lateral_deviation * lateral_.at(at)); };
  const Vector2 here = place(s), forward = (place(s + small) - place(s - small)).normalized();
  SE3 level;  // columns: right, down, forward
  level.R.col(0) = Vector3(forward.y(), 0, -forward.x());
  level.R.col(1) = Vector3(0, 1, 0);
  level.R.col(2) = Vector3(forward.x(), 0, forward.y());
  level.t = Vector3(here.x(), -options_.camera_height + 0.015 * bounce_.at(s), here.y());
  const Vector3 turn(0.012 * pitch_.at(s), options_.heading_deviation * heading_.at(s), 0.010 * roll_.at(s));
  return SE3{level.R * so3_exp(turn), level.t};
}

Motion Trajectory::motion(double frame) const {
  const double h = kDifference, frames = h * options_.rate;
  const SE3 before = pose(frame - frames), here = pose(frame), after = pose(frame + frames);
  const Vector3 back = so3_log(here.R.transpose() * before.R), on = so3_log(here.R.transpose() * after.R);
  return {here, (after.t - before.t) / (2 * h), (after.t - 2 * here.t + before.t) / (h * h), (on - back) / (2 * h),
          (on + back) / (h * h)};
}

}  // namespace relmap::sim
