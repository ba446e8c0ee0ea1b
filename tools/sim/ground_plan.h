// Closed plane curves by arc length: the ground plan of the drives.
#pragma once

#include <vector>

namespace relmap::sim {

enum class PlanShape {
  kFigure8,           // x = sin(2t)/2, z = sin(t), scaled to the length: crosses itself once
  kCircle,            //
  kRoundedRectangle,  // twice as long as wide, corners of a fifth of its width
};

// Where the robot is after `s` metres: x to the right of the start's north, z north, both in metres;
// yaw is the direction of travel, 0 along z and growing towards x, radians.
struct PlanePose {
  double x = 0, z = 0, yaw = 0;
};

class GroundPlan {
 public:
  // `length` in metres, > 0.
  GroundPlan(PlanShape shape, double length);

  double length() const { return length_; }
  PlanePose at(double s) const;  // any s, taken modulo the length

 private:
  PlanePose figure8(double s) const;
  PlanePose rounded_rectangle(double s) const;

  PlanShape shape_;
  double length_;
  double scale_ = 1;         // of the figure of eight
  std::vector<double> arc_;  // its length up to t = 2 pi k / (size - 1), unscaled
};

}  // namespace relmap::sim
