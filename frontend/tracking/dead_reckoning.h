// Where the camera goes while it is not seen: its velocity stays, its rotation is the gyro's where there is one, that
// of the pictures where they still tell it, or goes on and dies down.
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

  // The motion over the `dt` seconds that follow. `turn`, if the rotation is known better; `unlike`: it is not, and the
  // pictures before and after look so different that it may have been a fast one.
  struct Step {
    SE3 T_from_to;
    Matrix6 covariance = Matrix6::Zero();  // that it adds, if vision does not measure it
  };
  Step expect(double dt, const Gyro::Turn* turn = nullptr, bool unlike = false) const;

  // Vision did not measure the last step; it was taken as expected.
  void unsensed(double dt) {
    blind_s_ += dt;
    stale_s_ += dt;
  }
  // The camera knows again where it is, but not how it came there.
  void found() { blind_s_ = 0; }
  double blind_s() const { return blind_s_; }  // seconds since the camera knew where it was
  double stale_s() const { return stale_s_; }  // seconds since the velocity was measured

 private:
  std::optional<Vector6> fresh_;      // over the last pair
  Vector6 steady_ = Vector6::Zero();  // smoothed over half a second
  double blind_s_ = 0, stale_s_ = 0;
};

}  // namespace relmap::tracking
