// Predicts the motion of the camera when vision does not measure it. The velocity is taken as constant. The rotation
// comes from a gyro or, if the pictures still show it, from them; otherwise the last rotation continues and decays.
#pragma once

#include <cstdint>
#include <optional>

#include "frontend/tracking/gyro.h"

namespace relmap::tracking {

class DeadReckoning {
 public:
  // Vision measured the motion between two pairs, `dt` seconds apart.
  void sensed(const SE3& T_from_to, double dt);

  bool knows_velocity() const { return fresh_.has_value(); }

  // The motion over the next `dt` seconds. `turn` is given if the rotation is known from elsewhere. `unlike` says that
  // it is not, and that the pictures before and after look so different that the camera may have turned fast.
  struct Step {
    SE3 T_from_to;
    Matrix6 covariance = Matrix6::Zero();  // added by this step if vision does not measure it
  };
  Step expect(double dt, const Gyro::Turn* turn = nullptr, bool unlike = false) const;

  // Vision did not measure the last step, of `dt` seconds; the expected motion was used instead.
  void unsensed(double dt) {
    blind_s_ += dt;
    stale_s_ += dt;
  }
  // The pose is known again, but not the motion that led to it.
  void found() { blind_s_ = 0; }
  double blind_s() const { return blind_s_; }  // seconds since the pose was known
  double stale_s() const { return stale_s_; }  // seconds since the velocity was measured

 private:
  std::optional<Vector6> fresh_;      // velocity over the last pair
  Vector6 steady_ = Vector6::Zero();  // velocity smoothed over half a second
  double blind_s_ = 0, stale_s_ = 0;
};

}  // namespace relmap::tracking
