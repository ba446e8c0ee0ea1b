#include "tools/sim/points_world.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "tools/sim/descriptor.h"
#include "tools/sim/random.h"

namespace relmap::sim {

namespace {

constexpr std::uint32_t kMaxLife = 30;  // frames: a track stays within D edges of its base
constexpr std::uint32_t kOdometryStride = 64;
constexpr double kBorderMargin = 5;  // sigmas kept from the picture's border, so that noise carries nothing outside
constexpr int kMaxDraws = 30;
constexpr double kMinDepth = 0.3;         // metres
constexpr double kPointSize = 0.15;       // metres: the described region
constexpr double kPixelNoiseLimit = 4.9;  // sigmas; below kBorderMargin

// The purposes of the streams of random numbers.
enum Purpose : std::uint64_t { kLife, kPlace, kSeenAgain, kPixel, kStep, kDescriptor, kDescriptorNoise };

// PointId: kind, lap (27 bits), phase (24 bits), slot (12 bits).
PointId make_id(bool tracked, std::uint64_t lap, std::uint64_t phase, std::uint64_t slot) {
  return (std::uint64_t{tracked} << 63) | (lap << 36) | (phase << 12) | slot;
}
std::uint64_t lap_of(PointId id) { return (id >> 36) & ((1U << 27) - 1); }
std::uint64_t phase_of(PointId id) { return (id >> 12) & ((1U << 24) - 1); }

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }

}  // namespace

PointsWorldOptions figure8_options(std::uint64_t noise_seed) {
  PointsWorldOptions options;
  options.noise_seed = noise_seed;
  options.shape = PlanShape::kFigure8;
  options.frames = 288;
  options.frames_per_lap = 276;
  options.robot = "figure8";
  options.session = "figure8";
  return options;
}

PointsWorld::PointsWorld(PointsWorldOptions options)
    : options_(std::move(options)), plan_(options_.shape, options_.step * options_.frames_per_lap) {
  assert(options_.frames > 0 && options_.frames_per_lap > 0 && options_.frames_per_lap < (1U << 24));
  if (options_.appearance > 0) {
    // More than half as many again as if all lived out their lives; what is too much is left out frame by frame.
    const double all = 1.6 * options_.appearance / (2 + options_.mean_extra);
    appearance_births_ = std::clamp(all - options_.births, 0.0, 4000.0);
  }
  SE3 pose;
  for (std::uint32_t i = 0; i < options_.frames; ++i) {
    if (i > 0) pose = (pose * step(i)).normalized();
    if (i % kOdometryStride == 0) odometry_.push_back(pose);
  }
  seen_at_start_ = sightings(0, Kind::kTracked);
}

SE3 PointsWorld::pose(std::int64_t i) const {
  const double s = options_.step * static_cast<double>(i);
  const auto lap = static_cast<double>(floor_div(i, options_.frames_per_lap));
  const PlanePose at = plan_.at(s);
  const double aside = options_.lateral_per_lap * lap;
  const double pitch = options_.pitch * std::sin(1.3 * s);
  SE3 pose;
  pose.R = so3_exp({0, at.yaw, 0}) * so3_exp({pitch, 0, 0});
  const double climbed = options_.climb * (static_cast<double>(i) / options_.frames_per_lap - lap);
  pose.t = {at.x + aside * std::cos(at.yaw), -options_.height * std::sin(0.7 * s) - climbed,
            at.z - aside * std::sin(at.yaw)};
  return pose;
}

SE3 PointsWorld::T_world_frame(std::uint32_t i) const { return pose(i); }

SE3 PointsWorld::step(std::uint32_t i) const {
  Stream noise(options_.noise_seed, kStep, i);
  Vector6 xi;
  for (int k = 0; k < 6; ++k) xi[k] = noise.normal() * (k < 3 ? options_.step_noise_m : options_.step_noise_rad);
  return pose(i - 1).inverse() * pose(i) * SE3::exp(xi);
}

SE3 PointsWorld::T_odom_frame(std::uint32_t i) const {
  SE3 pose = odometry_[i / kOdometryStride];
  for (std::uint32_t k = i / kOdometryStride * kOdometryStride + 1; k <= i; ++k) pose = (pose * step(k)).normalized();
  return pose;
}

std::uint32_t PointsWorld::births(std::int64_t i, Kind kind) const {
  const double rate = kind == Kind::kTracked ? options_.births : appearance_births_;
  const auto phase = static_cast<double>(i - floor_div(i, options_.frames_per_lap) * options_.frames_per_lap);
  return static_cast<std::uint32_t>(std::floor(rate * (phase + 1)) - std::floor(rate * phase));
}

PointId PointsWorld::born(std::int64_t i, std::uint32_t slot, Kind kind) const {
  std::int64_t lap = floor_div(i, options_.frames_per_lap);
  const auto phase = static_cast<std::uint64_t>(i - lap * options_.frames_per_lap);
  lap = std::max<std::int64_t>(lap, 0);
  const PointId original = make_id(kind == Kind::kTracked, 0, phase, slot);
  if (lap == 0 || Stream(options_.world_seed, kSeenAgain, static_cast<std::uint64_t>(lap), original).uniform() <
                      options_.seen_again)
    return original;
  return make_id(kind == Kind::kTracked, static_cast<std::uint64_t>(lap), phase, slot);
}

std::uint32_t PointsWorld::life(PointId id) const {
  const double go_on = options_.mean_extra / (1 + options_.mean_extra);
  if (go_on <= 0) return 2;
  const double u = 1 - Stream(options_.world_seed, kLife, id).uniform();
  return static_cast<std::uint32_t>(std::min<double>(kMaxLife, 2 + std::floor(std::log(u) / std::log(go_on))));
}

PointsWorld::Point PointsWorld::make_point(PointId id) const {
  const StereoCamera& camera = options_.camera;
  Stream random(options_.world_seed, kPlace, id);
  Point point;
  point.life = life(id);
  point.mono = random.uniform() < options_.mono_share;
  const double margin = kBorderMargin * options_.pixel_noise;
  const auto birth = static_cast<std::int64_t>(lap_of(id) * options_.frames_per_lap + phase_of(id));
  const SE3 T_world_birth = pose(birth);
  const SE3 T_next_world = pose(birth + 1).inverse();
  // Drawn again until the next frame sees the point, too: two frames must see it.
  for (int draw = 0; draw < kMaxDraws; ++draw) {
    const double depth = options_.depth_min * std::pow(options_.depth_max / options_.depth_min, random.uniform());
    const double disparity = point.mono ? 0 : camera.f * camera.baseline / depth;
    const double u = random.uniform(margin + disparity, camera.width - 1 - margin);
    const double v = random.uniform(margin, camera.height - 1 - margin);
    point.in_world = T_world_birth * (Vector3((u - camera.cx) / camera.f, (v - camera.cy) / camera.f, 1) * depth);
    if (visible(point, T_next_world)) break;
  }
  return point;
}

Vector3 PointsWorld::point(PointId id) const { return make_point(id).in_world; }

bool PointsWorld::visible(const Point& point, const SE3& T_frame_world) const {
  const Vector3 p = T_frame_world * point.in_world;
  if (p.z() < kMinDepth) return false;
  const StereoCamera& camera = options_.camera;
  const StereoPixel z = camera.project(p);
  const double margin = kBorderMargin * options_.pixel_noise;
  const double left = point.mono ? z.x() : z.z();
  return left >= margin - 1e-6 && z.x() <= camera.width - 1 - margin + 1e-6 && z.y() >= margin - 1e-6 &&
         z.y() <= camera.height - 1 - margin + 1e-6;
}

std::vector<PointsWorld::Sighting> PointsWorld::sightings(std::uint32_t i, Kind kind) const {
  std::array<SE3, kMaxLife> T_frame_world;  // [k]: of frame i - k
  for (std::uint32_t k = 0; k < kMaxLife; ++k) T_frame_world[k] = pose(std::int64_t{i} - k).inverse();
  std::vector<Sighting> result;
  for (std::uint32_t age = 0; age < kMaxLife; ++age) {
    const std::int64_t birth = std::int64_t{i} - age;
    const std::uint32_t count = births(birth, kind);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
      const PointId id = born(birth, slot, kind);
      if (life(id) <= age) continue;
      const Point point = make_point(id);
      bool tracked = true;  // without a break since its birth
      for (std::uint32_t k = 0; tracked && k <= age; ++k) tracked = visible(point, T_frame_world[k]);
      if (tracked) result.push_back({id, birth, slot, T_frame_world[0] * point.in_world, point.mono});
    }
  }
  return result;
}

TrackId PointsWorld::track_of(const Sighting& sighting) const {
  if (sighting.born <= 0) {  // introduced by frame 0, whose order is not that of slots
    const auto at = std::find_if(seen_at_start_.begin(), seen_at_start_.end(),
                                 [&](const Sighting& s) { return s.born == sighting.born && s.slot == sighting.slot; });
    assert(at != seen_at_start_.end());
    return {0, static_cast<std::uint32_t>(at - seen_at_start_.begin())};
  }
  // The frame that introduces landmarks lists them first, by slot: the rank among those that it sees.
  const SE3 T_frame_world = pose(sighting.born).inverse();
  std::uint32_t rank = 0;
  for (std::uint32_t slot = 0; slot < sighting.slot; ++slot)
    if (visible(make_point(born(sighting.born, slot, Kind::kTracked)), T_frame_world)) ++rank;
  return {static_cast<std::uint32_t>(sighting.born), rank};
}

TrackMeasurement PointsWorld::measure(const Sighting& sighting, std::uint32_t i) const {
  Stream noise(options_.noise_seed, kPixel, i, sighting.id);
  StereoPixel z = options_.camera.project(sighting.in_frame);
  for (int k = 0; k < 3; ++k)
    z[k] += options_.pixel_noise * std::clamp(noise.normal(), -kPixelNoiseLimit, kPixelNoiseLimit);
  TrackMeasurement m;
  m.u_left = static_cast<float>(z.x());
  m.v = static_cast<float>(z.y());
  // Noise may make the disparity of a far point negative; no matcher would report that.
  m.u_right =
      sighting.mono || z.z() > z.x() - 0.05 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(z.z());
  return m;
}

std::vector<PointId> PointsWorld::landmarks(std::uint32_t i) const {
  std::vector<PointId> ids;
  for (const Sighting& s : sightings(i, Kind::kTracked)) ids.push_back(s.id);
  return ids;
}

Keyframe PointsWorld::keyframe(std::uint32_t i) const {
  assert(i < options_.frames);
  const auto step_us = static_cast<std::int64_t>(std::llround(1e6 * options_.step / options_.speed));
  Keyframe keyframe;
  keyframe.session.uuid = options_.uuid;
  keyframe.session.robot = options_.robot;
  keyframe.session.name = options_.session;
  keyframe.session.camera = options_.camera;
  keyframe.sequence = i;
  keyframe.time_us = options_.start_us + step_us * i;
  keyframe.T_odom_frame = T_odom_frame(i);
  if (i > 0) {
    keyframe.source = MotionSource::kVision;
    keyframe.step_covariance.diagonal().head<3>().setConstant(std::pow(options_.step_noise_m, 2));
    keyframe.step_covariance.diagonal().tail<3>().setConstant(std::pow(options_.step_noise_rad, 2));
    keyframe.driven_us = step_us;
  }
  const std::vector<Sighting> seen = sightings(i, Kind::kTracked);
  for (const Sighting& sighting : seen) {
    keyframe.tracks.push_back(measure(sighting, i));
    keyframe.tracks.back().track = track_of(sighting);
  }
  if (options_.appearance > 0) add_appearance(seen, i, keyframe);
  return keyframe;
}

void PointsWorld::add_appearance(const std::vector<Sighting>& tracked, std::uint32_t i, Keyframe& keyframe) const {
  const auto add = [&](const Sighting& sighting, const TrackMeasurement& m, int track) {
    AppearanceFeature feature;
    feature.u = m.u_left;
    feature.v = m.v;
    feature.disparity = m.u_left - m.u_right;  // NaN stays NaN
    feature.scale = static_cast<float>(std::clamp(options_.camera.f * kPointSize / sighting.in_frame.z(), 4.0, 64.0));
    Stream random(options_.world_seed, kDescriptor, sighting.id);
    feature.angle = static_cast<float>(random.uniform(-3.14, 3.14));
    feature.track = static_cast<std::int16_t>(track);
    feature.descriptor = make_descriptor(random);
    Stream noise(options_.noise_seed, kDescriptorNoise, i, sighting.id);
    disturb_descriptor(feature.descriptor, options_.descriptor_noise, noise);
    keyframe.appearance.push_back(feature);
  };
  for (std::size_t k = 0; k < tracked.size() && keyframe.appearance.size() < options_.appearance; ++k)
    add(tracked[k], keyframe.tracks[k], static_cast<int>(k));
  for (const Sighting& sighting : sightings(i, Kind::kAppearance)) {
    if (keyframe.appearance.size() >= options_.appearance) break;
    add(sighting, measure(sighting, i), -1);
  }
}

}  // namespace relmap::sim
