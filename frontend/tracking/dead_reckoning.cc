#include "frontend/tracking/dead_reckoning.h"

#include <algorithm>
#include <cmath>

namespace relmap::tracking {

namespace {

constexpr double kSmoothing = 0.4;     // seconds
constexpr double kTurnDecay = 0.5;     // seconds
constexpr double kAcceleration = 1.0;  // m/s^2, of a robot that brakes or accelerates
constexpr double kSpeedError = 0.05;   // share of the speed
constexpr double kTurnRate = 0.3;      // rad/s, of a turn that was not measured
constexpr double kFastTurnRate = 2.0;  // rad/s, of a turn after which the picture looks different
constexpr double kUnknownSpeed = 1.0;  // m/s

}  // namespace

void DeadReckoning::sensed(const SE3& T_from_to, double dt) {
  const Vector6 velocity = T_from_to.log() / dt;
  if (!fresh_ || stale_s_ > 0) steady_ = velocity;
  steady_ += (1 - std::exp(-dt / kSmoothing)) * (velocity - steady_);
  fresh_ = velocity;
  blind_s_ = stale_s_ = 0;
}

DeadReckoning::Step DeadReckoning::expect(double dt, const Gyro::Turn* turn, bool unlike) const {
  Vector6 motion = (stale_s_ > 0 ? steady_ : fresh_.value_or(Vector6::Zero())) * dt;
  motion.tail<3>() *= std::exp(-stale_s_ / kTurnDecay) * std::min(1.0, kTurnDecay / dt);
  Step step{SE3::exp(motion)};
  // The errors of consecutive steps are correlated: an error of speed or turn rate has the same sign in each. The
  // variances of the steps must add up to the square of the error over the whole time without vision.
  const auto added = [&](auto error) {
    const double before = error(blind_s_), after = error(blind_s_ + dt);
    return after * after - before * before;
  };
  const double speed = fresh_ ? steady_.head<3>().norm() : kUnknownSpeed;
  const double moved = added([&](double t) { return kSpeedError * speed * t + 0.5 * kAcceleration * t * t; });
  double turned = added([&](double t) { return kTurnRate * t * std::min(1.0, 0.2 + t); });
  if (turn) {
    step.T_from_to.R = turn->R_from_to;
    turned = turn->noise * turn->noise + added([&](double t) { return turn->bias_sigma * t; });
  } else if (unlike) {
    turned += std::pow(kFastTurnRate * dt, 2);
  }
  step.covariance.diagonal().head<3>().setConstant(moved);
  step.covariance.diagonal().tail<3>().setConstant(turned);
  return step;
}

}  // namespace relmap::tracking
