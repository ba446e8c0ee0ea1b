#include "tools/sim/trajectory.h"

#include <cmath>

namespace relmap::sim {
namespace {

// Long enough that the circuit's table, which is linear between its entries, does not show in second differences;
// short against the shortest waves of a drive.
constexpr double kDifference = 0.015;  // seconds

}  // namespace

Trajectory::Trajectory(const PictureWorldOptions& o, const Circuit& circuit, const FaultSchedule& faults)
    : options_(o),
      circuit_(circuit),
      faults_(faults),
      road_(o, circuit),
      lateral_(Random(o.seed_of_drive(), 11), 13 * o.stretch(), 47 * o.stretch()),
      heading_(Random(o.seed_of_drive(), 12), 9 * o.stretch(), 31 * o.stretch()),
      pitch_(Random(o.seed_of_drive(), 13), 5 * o.stretch(), 17 * o.stretch()),
      roll_(Random(o.seed_of_drive(), 14), 6 * o.stretch(), 23 * o.stretch()),
      bounce_(Random(o.seed_of_drive(), 15), 4 * o.stretch(), 11 * o.stretch()),
      speed_(Random(o.seed_of_drive(), 16), 15 * o.stretch(), 40 * o.stretch()) {
  if (o.ride != RideKind::kNone) itinerary_.emplace(o);
}

double Trajectory::distance(double frame) const {
  if (itinerary_) return itinerary_->at(frame / options_.rate).driven;
  return options_.start + options_.step * frame + speed_.at(options_.step * frame);
}

// The road below the robot, and the robot's place on it, which is a function of what it has driven: it stays as it is
// while the robot is carried, and what carries it moves as the road below does.
SE3 Trajectory::on_road(const Itinerary::State& state) const {
  const double s = state.driven, small = 0.01, sway = options_.lateral_deviation;
  const double slant = sway * (lateral_.at(s + small) - lateral_.at(s - small)) / (2 * small);
  const Vector3 turn(0.012 * pitch_.at(s), options_.heading_deviation * heading_.at(s), 0.010 * roll_.at(s));
  const SE3 T_road_left{so3_exp(Vector3(0, std::atan(slant), 0)) * so3_exp(turn),
                        Vector3(sway * lateral_.at(s), -options_.camera_height + 0.015 * bounce_.at(s), 0)};
  SE3 T_world_road = road_.T_world_road(state.way);
  T_world_road.t.y() -= state.level;
  return T_world_road * T_road_left;
}

SE3 Trajectory::straight(double frame) const {
  if (itinerary_) return on_road(itinerary_->at(frame / options_.rate));
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

SE3 Trajectory::pose(double frame) const {
  const SE3 T = straight(frame);
  const double angle = faults_.head_turn(frame).angle;
  if (angle == 0) return T;
  const SE3 turn{so3_exp(Vector3(0, angle, 0)), head()};
  return T * turn * SE3{Matrix3::Identity(), -head()};
}

Motion Trajectory::motion(double frame) const {
  const double h = kDifference, frames = h * options_.rate;
  const SE3 here = straight(frame), before = straight(frame - frames), after = straight(frame + frames);
  const Vector3 back = so3_log(here.R.transpose() * before.R), on = so3_log(here.R.transpose() * after.R);
  // The motion of the drive by finite differences, that of the head analytically.
  const HeadTurn head_turn = faults_.head_turn(frame);
  const Vector3 down = Vector3::UnitY();
  const Matrix3 R_head_straight = so3_exp(-head_turn.angle * down);
  const Vector3 carried = R_head_straight * (on - back) / (2 * h);
  const Vector3 w = carried + head_turn.rate * down;
  const Vector3 dw =
      R_head_straight * (on + back) / (h * h) + head_turn.rate * carried.cross(down) + head_turn.acceleration * down;
  // Of the head's axis, which does not depend on the turn, and from there to the eye.
  const Vector3 a = before * head(), b = here * head(), c = after * head(), eye = -head();
  Motion out{pose(frame), (c - a) / (2 * h), (c - 2 * b + a) / (h * h), w, dw};
  out.velocity += out.T_world_left.R * w.cross(eye);
  out.acceleration += out.T_world_left.R * (dw.cross(eye) + w.cross(w.cross(eye)));
  return out;
}

}  // namespace relmap::sim
