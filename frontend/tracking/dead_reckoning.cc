#include "frontend/tracking/dead_reckoning.h"

#include <algorithm>
#include <cmath>

namespace relmap {

namespace {

constexpr double kSmoothing = 0.4;     // seconds
constexpr double kTurnDecay = 0.5;     // seconds
constexpr double kAcceleration = 1.0;  // m/s^2, of a robot that brakes or pulls away
constexpr double kSpeedError = 0.05;   // of the speed
constexpr double kTurnRate = 0.3;      // rad/s: what a turn that nobody saw may come to
constexpr double kUnknownSpeed = 1.0;  // m/s

}  // namespace

void DeadReckoning::sensed(const SE3& T_from_to, double dt) {
  const Vector6 velocity = T_from_to.log() / dt;
  if (!fresh_ || blind_s_ > 0) steady_ = velocity;
  steady_ += (1 - std::exp(-dt / kSmoothing)) * (velocity - steady_);
  fresh_ = velocity;
  blind_s_ = 0;
}

void DeadReckoning::forget() {
  fresh_.reset();
  steady_.setZero();
}

DeadReckoning::Step DeadReckoning::expect(double dt, const Gyro::Turn* turn) const {
  Vector6 velocity = blind_s_ > 0 ? steady_ : fresh_.value_or(Vector6::Zero());
  velocity.tail<3>() *= std::exp(-blind_s_ / kTurnDecay);
  Step step{SE3::exp(velocity * dt)};
  double turn_sigma = kTurnRate * dt * std::min(1.0, 0.2 + blind_s_ + dt);
  if (turn) {
    step.T_from_to.R = turn->R_from_to;
    turn_sigma = turn->sigma;
  }
  // A change of speed adds up with the time since the speed was known: each step's error grows with it, and the errors
  // of steps have the same sign. Summed as variances over n steps they must give (a t^2 / 2)^2.
  const double speed = fresh_ ? steady_.head<3>().norm() : kUnknownSpeed;
  const auto drift = [&](double t) { return kSpeedError * speed * t + 0.5 * kAcceleration * t * t; };
  const double before = drift(blind_s_), after = drift(blind_s_ + dt);
  step.covariance.diagonal().head<3>().setConstant(after * after - before * before);
  step.covariance.diagonal().tail<3>().setConstant(turn_sigma * turn_sigma);
  return step;
}

}  // namespace relmap
