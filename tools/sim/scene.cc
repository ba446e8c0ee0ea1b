#include "tools/sim/scene.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace relmap::sim {

Surface make_surface(std::span<const Vector3> corners, const std::array<Vector2, 3>& texels, int texture) {
  Surface s;
  s.corners.fill(corners[0]);
  s.corner_count = static_cast<int>(corners.size());
  std::copy(corners.begin(), corners.end(), s.corners.begin());
  s.texture = texture;
  const Vector3 a = corners[1] - corners[0], b = corners[2] - corners[0];
  s.normal = a.cross(b).normalized();
  s.distance = s.normal.dot(corners[0]);
  Matrix3 rows;
  rows << a.transpose(), b.transpose(), s.normal.transpose();
  const Matrix3 inverse = rows.inverse();
  s.u = inverse * Vector3(texels[1].x() - texels[0].x(), texels[2].x() - texels[0].x(), 0);
  s.v = inverse * Vector3(texels[1].y() - texels[0].y(), texels[2].y() - texels[0].y(), 0);
  s.u0 = texels[0].x() - 0.5 - s.u.dot(corners[0]);
  s.v0 = texels[0].y() - 0.5 - s.v.dot(corners[0]);
  const Vector3 sun = Vector3(0.5, -0.6, 0.62).normalized();
  s.gain = static_cast<float>(kDiffuseLight + kDirectLight * std::abs(s.normal.dot(sun)));
  return s;
}

Surface moved(Surface s, const SE3& motion) {
  for (Vector3& corner : s.corners) corner = motion * corner;
  s.normal = motion.R * s.normal;
  s.distance += s.normal.dot(motion.t);
  s.u = motion.R * s.u;
  s.v = motion.R * s.v;
  s.u0 -= s.u.dot(motion.t);
  s.v0 -= s.v.dot(motion.t);
  return s;
}

}  // namespace relmap::sim
