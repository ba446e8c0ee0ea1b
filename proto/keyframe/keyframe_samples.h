// Random keyframes that pass every check, for tests.
#pragma once

#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include "proto/calibration/calibration_samples.h"
#include "proto/keyframe/keyframe.h"

namespace relmap {

inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

class KeyframeSampler {
 public:
  explicit KeyframeSampler(std::uint64_t seed) : random_(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  SE3 pose() {
    Vector6 xi;
    for (int i = 0; i < 6; ++i) xi[i] = i < 3 ? uniform(-100, 100) : uniform(-1.8, 1.8);
    return SE3::exp(xi);
  }

  Matrix6 covariance() {
    Matrix6 a;
    for (int i = 0; i < 36; ++i) a(i / 6, i % 6) = uniform(-0.1, 0.1);
    Matrix6 m = a * a.transpose() + 1e-4 * Matrix6::Identity();
    return 0.5 * (m + m.transpose().eval());
  }

  // A keyframe that passes every check.
  Keyframe keyframe() {
    Keyframe k;
    k.session.uuid.bytes.fill(static_cast<std::uint8_t>(integer(1, 255)));
    k.session.robot = "Zürich-" + std::to_string(integer(0, 99));
    k.session.name = "morning";
    k.session.camera = {400, 256, 192, 0.12, 512, 384};
    k.session.oneway = integer(0, 1) == 1;
    k.sequence = static_cast<std::uint32_t>(integer(0, 100000));
    k.time_us = 1'700'000'000'000'000 + integer(0, 1 << 30);
    k.T_odom_frame = pose();
    k.source = static_cast<MotionSource>(integer(0, kMotionSources - 1));
    if (k.source != MotionSource::kStart) k.step_covariance = covariance();
    k.driven_us = integer(0, 1000000);
    k.standing_us = integer(0, 1000000);
    const int tracks = integer(1, 40);
    for (int i = 0; i < tracks; ++i) k.tracks.push_back(track(k, static_cast<std::uint32_t>(i)));
    const int features = integer(1, 20);
    for (int i = 0; i < features; ++i) k.appearance.push_back(feature(tracks));
    if (integer(0, 1)) k.picture = {0xff, 0xd8, 0xff, 0xe0, static_cast<std::uint8_t>(integer(0, 255))};
    if (integer(0, 3) == 0) k.session.raw = sample_raw_calibration(3);
    if (integer(0, 3) == 0) k.session.unknown = extensions();
    if (integer(0, 3) == 0) k.unknown = extensions();
    return k;
  }

 private:
  Extensions extensions() {
    Extensions all;
    std::uint32_t tag = 1000;
    for (int n = integer(1, 3); n > 0; --n) {
      tag += static_cast<std::uint32_t>(integer(1, 1 << 20));
      all.push_back({tag, Bytes(static_cast<std::size_t>(integer(0, 40)), static_cast<std::uint8_t>(n))});
    }
    return all;
  }

  TrackMeasurement track(const Keyframe& k, std::uint32_t index) {
    TrackMeasurement t;
    t.track = {static_cast<std::uint32_t>(integer(0, static_cast<int>(k.sequence))), index};
    t.u_left = static_cast<float>(uniform(60, 511));
    t.v = static_cast<float>(uniform(0, 383));
    t.u_right = integer(0, 3) ? t.u_left - static_cast<float>(uniform(0, 50)) : kNaN;
    t.level = static_cast<std::uint8_t>(integer(0, 3));
    return t;
  }

  AppearanceFeature feature(int tracks) {
    AppearanceFeature f;
    f.u = static_cast<float>(uniform(0, 511));
    f.v = static_cast<float>(uniform(0, 383));
    f.disparity = integer(0, 1) ? static_cast<float>(uniform(0, 40)) : kNaN;
    f.scale = static_cast<float>(uniform(2, 60));
    f.angle = static_cast<float>(uniform(-3, 3));
    f.track = static_cast<std::int16_t>(integer(-1, tracks - 1));
    for (auto& d : f.descriptor) d = static_cast<std::uint8_t>(integer(0, 255));
    return f;
  }

  std::mt19937_64 random_;
};

// A keyframe that has a step, and no extensions.
inline Keyframe sample_keyframe(std::uint64_t seed = 7) {
  Keyframe k = KeyframeSampler(seed).keyframe();
  k.source = MotionSource::kVision;
  k.step_covariance = KeyframeSampler(seed).covariance();
  k.session.raw.reset();
  k.session.unknown = k.unknown = {};
  return k;
}

}  // namespace relmap
