#include "frontend/tracking/gyro.h"

#include <algorithm>
#include <cmath>

#include "frontend/tracking/stamps.h"

namespace relmap::tracking {

namespace {

constexpr std::int64_t kMaxHoleUs = 50'000;
constexpr double kFirstBias = 0.02;   // rad/s, standard deviation of the bias when a gyro is switched on
constexpr double kGate = 4;           // sigmas
constexpr double kMinSeconds = 0.02;  // seconds

}  // namespace

Gyro::Gyro(const ImuCalibration& calibration, const Matrix3& R_frame_camera)
    : calibration_(calibration),
      R_frame_imu_(R_frame_camera * calibration.R_camera_imu),
      bias_variance_(kFirstBias * kFirstBias) {}

void Gyro::add(std::span<const ImuSample> samples) {
  for (const ImuSample& sample : samples) {
    if (!sample.gyro.allFinite() || (!rates_.empty() && sample.time_us <= rates_.back().time_us)) continue;
    rates_.push_back({sample.time_us, R_frame_imu_ * sample.gyro});
  }
}

void Gyro::forget_before(std::int64_t time_us) {
  // One sample before that time is kept for interpolation.
  while (rates_.size() > 1 && rates_[1].time_us <= time_us) rates_.pop_front();
}

double Gyro::bias_sigma() const { return std::sqrt(bias_variance_); }

Vector3 Gyro::rate_at(std::int64_t time_us, std::size_t after) const {
  const Rate &a = rates_[after - 1], &b = rates_[after];
  const double share = static_cast<double>(time_us - a.time_us) / static_cast<double>(b.time_us - a.time_us);
  return (1 - share) * a.rate + share * b.rate;
}

std::optional<Gyro::Turn> Gyro::turn(std::int64_t from_us, std::int64_t to_us) const {
  const auto first = std::upper_bound(rates_.begin(), rates_.end(), from_us,
                                      [](std::int64_t time, const Rate& rate) { return time < rate.time_us; });
  if (first == rates_.begin() || first == rates_.end() || rates_.back().time_us < to_us || to_us <= from_us)
    return std::nullopt;
  const Vector3 bias = R_frame_imu_ * bias_;
  Turn turn{Matrix3::Identity()};
  std::int64_t time = from_us;
  Vector3 rate = rate_at(from_us, static_cast<std::size_t>(first - rates_.begin()));
  for (auto next = static_cast<std::size_t>(first - rates_.begin()); time < to_us; ++next) {
    if (rates_[next].time_us - rates_[next - 1].time_us > kMaxHoleUs) return std::nullopt;
    const std::int64_t end = std::min(to_us, rates_[next].time_us);
    const Vector3 rate_end = rate_at(end, next);
    turn.R_from_to *= so3_exp((0.5 * (rate + rate_end) - bias) * seconds(end - time));
    time = end;
    rate = rate_end;
  }
  turn.noise = calibration_.gyro_noise * std::sqrt(seconds(to_us - from_us));
  turn.bias_sigma = bias_sigma();
  return turn;
}

void Gyro::correct(std::int64_t from_us, std::int64_t to_us, const Matrix3& R_from_to, double sigma) {
  const double dt = seconds(to_us - from_us);
  bias_variance_ =
      std::min(kFirstBias * kFirstBias, bias_variance_ + calibration_.gyro_walk * calibration_.gyro_walk * dt);
  const auto mine = turn(from_us, to_us);
  if (!mine || dt < kMinSeconds) return;
  // If too little bias was subtracted, the gyro's rotation is too large by the excess times the time.
  const Vector3 excess = so3_log(R_from_to.transpose() * mine->R_from_to) / dt;
  const double noise = calibration_.gyro_noise * calibration_.gyro_noise * dt + sigma * sigma;
  const double variance = noise / (dt * dt);
  if (excess.norm() > kGate * std::sqrt(3 * (bias_variance_ + variance))) return;
  const double gain = bias_variance_ / (bias_variance_ + variance);
  bias_ += gain * (R_frame_imu_.transpose() * excess);
  bias_variance_ *= 1 - gain;
}

}  // namespace relmap::tracking
