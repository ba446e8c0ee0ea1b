// SE(3), and the conventions of all code, messages and files of relmap:
//
//   T_ab maps coordinates in frame b to frame a:  p_a = T_ab p_b.  Lengths in metres, angles in radians.
//   A camera frame is x right, y down, z forward; a keyframe's frame is its rectified left camera.
//   Perturbations stand on the right:  T <- T Exp(xi),  xi = (rho, phi): translation first, metres and radians.
//   A covariance of T_ab is that of xi in T_ab Exp(xi), i.e. expressed in frame b.
//   Ad(T) = [R, [t]x R; 0, R], so that  T Exp(xi) T^-1 = Exp(Ad(T) xi).
//   Rotations are unit quaternions (w, x, y, z) on the wire and orthonormal matrices in memory.
//   Time is UTC in microseconds.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace relmap {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix3 = Eigen::Matrix3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// [v]x, the matrix of the cross product with v.
Matrix3 skew(const Vector3& v);

Matrix3 so3_exp(const Vector3& phi);
Vector3 so3_log(const Matrix3& rotation);  // |result| <= pi

struct SE3 {
  Matrix3 R = Matrix3::Identity();
  Vector3 t = Vector3::Zero();

  bool operator==(const SE3&) const = default;

  static SE3 exp(const Vector6& xi);
  static SE3 from_quaternion(const Eigen::Quaterniond& q, const Vector3& t) {
    return {q.normalized().toRotationMatrix(), t};
  }

  Vector6 log() const;
  SE3 inverse() const { return {R.transpose(), -(R.transpose() * t)}; }
  Matrix6 adjoint() const;
  Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(R); }
  // The same transform with R made orthonormal again.
  SE3 normalized() const { return {quaternion().normalized().toRotationMatrix(), t}; }

  SE3 operator*(const SE3& other) const { return {R * other.R, R * other.t + t}; }
  Vector3 operator*(const Vector3& p) const { return R * p + t; }
};

// d Log(T Exp(xi)) / d xi at xi = 0, where r = Log(T): the inverse right Jacobian of SE(3) at r.
// Barfoot, "State Estimation for Robotics", 7.1.5.
Matrix6 right_jacobian_inverse(const Vector6& r);

// Covariance of T_ab T_bc if the two are independent: Ad(T_cb) S_ab Ad(T_cb)' + S_bc.
Matrix6 compound_covariance(const Matrix6& s_ab, const SE3& T_bc, const Matrix6& s_bc);
// Covariance of T_ba, given that of T_ab.
Matrix6 inverse_covariance(const SE3& T_ab, const Matrix6& s_ab);

// Angle of a rotation, 0..pi.
double rotation_angle(const Matrix3& rotation);

}  // namespace relmap
