#include "proto/wire/convert_lcm.h"

#include <algorithm>
#include <iterator>

#include "proto/geometry/canonical_rotation.h"
#include "proto/wire/convert.h"

namespace relmap {

void put_pose(const SE3& T, const Matrix6& covariance, relmap_lcm::pose_t& message) {
  const QuaternionWxyz q = canonical_quaternion(T.R);
  std::copy(q.begin(), q.end(), message.rotation);
  std::copy(T.t.data(), T.t.data() + 3, message.translation);
  const UpperTriangle values = upper_triangle(covariance);
  std::copy(values.begin(), values.end(), message.covariance);
}

Result<PoseFromWire> get_pose(const relmap_lcm::pose_t& m) {
  const auto T = transform_of({m.rotation[0], m.rotation[1], m.rotation[2], m.rotation[3]},
                              {m.translation[0], m.translation[1], m.translation[2]});
  if (!T.ok()) return T.status();
  UpperTriangle values;
  std::copy(std::begin(m.covariance), std::end(m.covariance), values.begin());
  const Matrix6 covariance = from_upper_triangle(values);
  if (Status s = check_covariance(covariance); !s.ok()) return s;
  return PoseFromWire{*T, covariance};
}

}  // namespace relmap
