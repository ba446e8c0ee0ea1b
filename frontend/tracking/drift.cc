#include "frontend/tracking/drift.h"

#include <vector>

namespace relmap::tracking {

Drift measure_drift(std::span<const PosePair> poses, double length) {
  std::vector<double> travelled(poses.size(), 0);
  for (std::size_t i = 1; i < poses.size(); ++i)
    travelled[i] = travelled[i - 1] + (poses[i].truth.t - poses[i - 1].truth.t).norm();
  Drift drift;
  std::size_t end = 0;
  for (std::size_t start = 0; start < poses.size(); ++start) {
    while (end < poses.size() && travelled[end] < travelled[start] + length) ++end;
    if (end == poses.size()) break;
    const SE3 truth = poses[start].truth.inverse() * poses[end].truth;
    const SE3 estimate = poses[start].estimate.inverse() * poses[end].estimate;
    const SE3 error = estimate.inverse() * truth;
    drift.translation += error.t.norm() / length;
    drift.rotation += rotation_angle(error.R) / length;
    ++drift.segments;
  }
  if (drift.segments > 0) {
    drift.translation /= static_cast<double>(drift.segments);
    drift.rotation /= static_cast<double>(drift.segments);
  }
  return drift;
}

}  // namespace relmap::tracking
