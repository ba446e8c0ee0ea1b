// For tests: a chain of stereo keyframes past random points, with tracks, landmarks and appearance, and pictures of it
// from any pose. Measurements have Gaussian noise of the sigma that the map assumes.
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "server/place/descriptor.h"
#include "server/place/testing/hand_made_graph.h"

namespace relmap::place {

inline constexpr StereoCamera kStreetCamera{400, 255.5, 191.5, 0.3, 512, 384};

inline constexpr FrameId kStreetFrame{1, 6};  // about the middle of a street of 12 frames

class SyntheticStreet {
 public:
  // Frames 0.3 m apart along z; `noise` in pixels.
  SyntheticStreet(std::uint64_t seed, std::uint32_t frames, double noise, std::size_t points = 400)
      : random_(seed), noise_(noise) {
    for (std::size_t i = 0; i < points; ++i) {
      const double z = uniform(2, 0.3 * frames + 8);
      points_.push_back({uniform(-4, 4), uniform(-2.5, 2.5), z});
      Descriptor d;
      for (auto& byte : d) byte = static_cast<std::uint8_t>(random_() % 90);
      descriptors_.push_back(d);
    }
    base_.resize(points);
    for (const SessionNumber session : {1u, 2u}) graph.add_session(session, kStreetCamera);
    for (std::uint32_t i = 0; i < frames; ++i) add_frame(i);
  }

  SE3 pose(std::uint32_t frame) const { return {Matrix3::Identity(), Vector3(0, 0, 0.3 * frame)}; }

  // Returns the features that a camera at T_street_camera sees, and appends the index of each one's point to `points`.
  std::vector<AppearanceFeature> picture(const SE3& T_street_camera, bool stereo, std::vector<std::size_t>& points) {
    std::vector<AppearanceFeature> features;
    const SE3 T_camera_street = T_street_camera.inverse();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector3 p = T_camera_street * points_[i];
      if (p.z() < 1 || p.z() > 12) continue;
      StereoPixel z = kStreetCamera.project(p);
      for (int k = 0; k < 3; ++k) z[k] += noise_ * gaussian();
      if (!kStreetCamera.in_picture(z.x(), z.y()) || z.x() <= z.z()) continue;
      AppearanceFeature feature;
      feature.u = static_cast<float>(z.x());
      feature.v = static_cast<float>(z.y());
      feature.disparity = stereo ? static_cast<float>(z.x() - z.z()) : std::numeric_limits<float>::quiet_NaN();
      feature.scale = 5;
      feature.descriptor = descriptors_[i];
      for (auto& byte : feature.descriptor) byte = static_cast<std::uint8_t>(byte + random_() % 10);
      features.push_back(feature);
      points.push_back(i);
    }
    return features;
  }

  const Vector3& point(std::size_t i) const { return points_[i]; }  // in the street's frame, that of frame 0
  LandmarkId landmark_of(std::size_t point) const { return base_[point]; }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  double gaussian() { return std::sqrt(-2 * std::log(uniform(1e-12, 1))) * std::cos(uniform(0, 2 * M_PI)); }

  HandMadeGraph graph;

 private:
  void add_frame(std::uint32_t index) {
    const FrameId id{1, index};
    storage::FrameHot hot;
    storage::FrameWarm warm;
    storage::FrameCold cold;
    std::vector<std::size_t> points;
    cold.appearance = picture(pose(index), true, points);
    // Every other feature is tracked.
    for (std::size_t f = 0; f < points.size(); f += 2) {
      AppearanceFeature& feature = cold.appearance[f];
      LandmarkId& landmark = base_[points[f]];
      feature.track = static_cast<std::int16_t>(warm.observations.size());
      if (!landmark.valid()) {
        landmark = {id, static_cast<std::uint32_t>(hot.landmarks.size())};
        const Vector3 p = kStreetCamera.triangulate({feature.u, feature.v, double{feature.u} - feature.disparity});
        storage::Landmark made;
        made.abr = {p.x() / p.z(), p.y() / p.z(), 1 / p.z()};
        made.observers = {id};
        hot.landmarks.push_back(made);
      }
      warm.observations.push_back({landmark, {}, feature.u, feature.v, feature.u - feature.disparity, 0});
    }
    graph.add_frame(id, std::move(hot), std::move(warm), std::move(cold));
    if (index > 0) graph.add_edge({1, index - 1}, id, 0, SE3{Matrix3::Identity(), Vector3(0, 0, 0.3)});
  }

  std::mt19937_64 random_;
  double noise_;
  std::vector<Vector3> points_;
  std::vector<Descriptor> descriptors_;
  std::vector<LandmarkId> base_;
};

}  // namespace relmap::place
