#include "storage/maintenance/frame_check.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "proto/base/number_text.h"

namespace relmap::storage {
namespace {

constexpr double kOrthonormal = 1e-6;  // largest deviation of R'R from the identity: rounding stays far below
constexpr double kCovariance = 1e-6;   // largest asymmetry and largest negative eigenvalue of a correlation matrix

void check_transform(const SE3& T, const std::string& name, const Complain& complain) {
  if (!is_finite(T))
    complain(name + " is not finite");
  else if (!is_transform(T))
    complain("the rotation of " + name + " is not a rotation");
}

void check_edge(FrameId id, const Edge& edge, const Complain& complain_of_frame) {
  const std::string name = "edge " + edge.id.to_string();
  const Complain complain = [&](const std::string& what) { complain_of_frame(name + ": " + what); };
  if (edge.id.frame != id || edge.b != id) complain("it is stored with frame " + id.to_string());
  if (edge.a == edge.b || !edge.a.valid()) complain("it joins nothing");
  if ((edge.id.ordinal == 0) != (edge.kind != EdgeKind::kLoop)) complain("its kind does not go with its ordinal");
  check_transform(edge.T_ab, "its transform", complain);
  check_transform(edge.prior_T_ab, "its prior", complain);
  if (!is_covariance(edge.covariance)) complain("its covariance is not a covariance");
  if (!is_covariance(edge.prior_covariance)) complain("its prior's covariance is not a covariance");
  if (edge.around) {
    check_transform(edge.around->T, "its way around", complain);
    if (!is_covariance(edge.around->covariance)) complain("its way around has no covariance");
    if (edge.around->from.session != id.session) complain("its way around begins in another session");
  }
  const float numbers[] = {edge.driven_s, edge.standing_s, edge.probability, edge.spread};
  if (!std::all_of(std::begin(numbers), std::end(numbers), [](float x) { return std::isfinite(x); }))
    complain("a number is not finite");
  if (!std::is_sorted(edge.bound_frames.begin(), edge.bound_frames.end())) complain("its bound frames are not sorted");
  if (!std::is_sorted(edge.consistent_with.begin(), edge.consistent_with.end()))
    complain("the closures consistent with it are not sorted");
}

}  // namespace

bool is_finite(const SE3& T) { return T.R.allFinite() && T.t.allFinite(); }

bool is_finite(const Observation& z) { return std::isfinite(z.u_left) && std::isfinite(z.v) && !std::isinf(z.u_right); }

bool is_transform(const SE3& T) {
  return is_finite(T) && (T.R.transpose() * T.R - Matrix3::Identity()).cwiseAbs().maxCoeff() <= kOrthonormal &&
         T.R.determinant() > 0;
}

// Judged as a correlation matrix, so that units do not matter.
bool is_covariance(const Matrix6& m) {
  if (!m.allFinite() || m.diagonal().minCoeff() < 0) return false;
  const Vector6 sigma = m.diagonal().cwiseSqrt();
  const Vector6 scale = (sigma.array() > 0).select(sigma.cwiseInverse(), Vector6::Ones());
  const Matrix6 c = scale.asDiagonal() * m * scale.asDiagonal();
  if ((c - c.transpose()).cwiseAbs().maxCoeff() > kCovariance) return false;
  return Eigen::LLT<Matrix6>(c + kCovariance * Matrix6::Identity()).info() == Eigen::Success;
}

SE3 near_rotation(const SE3& T) {
  if (!is_finite(T)) return {};
  const Eigen::JacobiSVD<Matrix3> svd(T.R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3 signs = Matrix3::Identity();
  signs(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return {svd.matrixU() * signs * svd.matrixV().transpose(), T.t};
}

void check_hot(FrameId id, const FrameHot& frame, const Complain& complain) {
  if (!frame.present) complain("it is stored as absent");
  check_transform(frame.T_odom_frame, "its odometry pose", complain);
  if (!std::isfinite(frame.mean_error)) complain("its mean error is not finite");
  for (std::size_t i = 0; i < frame.edges.size(); ++i) {
    check_edge(id, frame.edges[i], complain);
    if (i > 0 && frame.edges[i].id <= frame.edges[i - 1].id) complain("its edges are not in order");
    if (frame.edges[i].id.ordinal >= frame.next_loop_ordinal) complain("its next ordinal is taken");
  }
  for (std::size_t slot = 0; slot < frame.landmarks.size(); ++slot) {
    const Vector3& abr = frame.landmarks[slot].abr;
    const std::string name = "landmark " + LandmarkId{id, static_cast<std::uint32_t>(slot)}.to_string();
    if (!abr.allFinite())
      complain(name + " is not finite");
    else if (abr.z() < kMinInverseDepth)
      complain(name + " has an inverse depth of " + number_text(abr.z()) + " per metre");
  }
}

void check_warm(FrameId, const FrameWarm& frame, const Complain& complain) {
  std::size_t bad = 0;
  for (const Observation& z : frame.observations) bad += !is_finite(z);
  if (bad > 0) complain(std::to_string(bad) + " observations are not finite");
}

void check_cold(FrameId, const FrameCold& frame, const Complain& complain) {
  std::size_t bad = 0;
  for (const AppearanceFeature& f : frame.appearance)
    bad += !std::isfinite(f.u) || !std::isfinite(f.v) || std::isinf(f.disparity) || !std::isfinite(f.scale) ||
           !std::isfinite(f.angle);
  if (bad > 0) complain(std::to_string(bad) + " features are not finite");
}

void check_session(const Session& session, const Complain& complain) {
  if (session.frames > 0 && session.first > session.last) complain("its first frame comes after its last");
  if (session.frames > 0 && session.next_sequence != session.last + 1 && session.next_sequence <= session.last)
    complain("its next sequence is not behind its last frame");
  if (session.frames > 0 && session.first_time_us > session.last_time_us) complain("it ends before it begins");
}

void check_skipped(const Session& session, const Skipped& skipped, std::uint64_t next, const Complain& complain) {
  if (skipped.from > skipped.to || skipped.from < next)
    complain("skipped sequences are not in order at " + std::to_string(skipped.from));
  if (skipped.to >= session.next_sequence && session.next_sequence != 0)
    complain("sequence " + std::to_string(skipped.to) + " is skipped and still expected");
  if (!is_reason(static_cast<std::uint16_t>(skipped.reason)))
    complain("sequence " + std::to_string(skipped.from) + " was skipped for an unknown reason");
}

}  // namespace relmap::storage
