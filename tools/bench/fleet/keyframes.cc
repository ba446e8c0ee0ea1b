#include "tools/bench/fleet/keyframes.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "frontend/capture/keyframe_file.h"
#include "tools/sim/descriptor.h"
#include "tools/sim/points_world.h"
#include "tools/sim/random.h"

namespace relmap::bench {

namespace {

constexpr double kPixelNoise = 0.5;  // of the lap, and again of every keyframe made of it
constexpr double kStepNoiseM = 0.01, kStepNoiseRad = 0.05 * M_PI / 180;
constexpr std::uint32_t kDescriptorNoise = 6;
constexpr std::size_t kFeatureBytes = 150;

enum Purpose : std::uint64_t { kUuid, kStep, kPixel };

// Second lap of a level circuit on which every point is seen again: a lap after it would be the same.
sim::PointsWorldOptions world_options(std::size_t keyframe_bytes, std::uint64_t seed) {
  sim::PointsWorldOptions options;
  options.world_seed = seed;
  options.frames = 2 * kLapFrames + 1;
  options.frames_per_lap = kLapFrames;
  options.height = options.pitch = 0;
  options.seen_again = 1;
  options.pixel_noise = kPixelNoise;
  options.step_noise_m = options.step_noise_rad = 0;
  options.appearance = static_cast<std::uint32_t>(keyframe_bytes * 6 / 7 / kFeatureBytes);
  return options;
}

// A textured JPEG of the camera's size halved, padded to `size` bytes; none where that is too few.
Bytes make_picture(const StereoCamera& camera, std::size_t size, std::uint64_t seed) {
  cv::Mat picture(camera.height / 2, camera.width / 2, CV_8UC1);
  cv::RNG random(seed);
  random.fill(picture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(picture, picture, {}, 3);
  cv::normalize(picture, picture, 0, 255, cv::NORM_MINMAX);
  for (int quality = 90; quality >= 10; quality -= 10) {
    Bytes jpeg;
    cv::imencode(".jpg", picture, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
    if (jpeg.size() > size) continue;
    jpeg.resize(size);  // what follows its end is nobody's business
    return jpeg;
  }
  return {};
}

}  // namespace

SessionUuid FleetRobot::uuid() const {
  sim::Stream random(seed, kUuid, number);
  SessionUuid uuid;
  for (std::uint8_t& byte : uuid.bytes) byte = static_cast<std::uint8_t>(random.bits());
  return uuid;
}

void FleetLap::make(const std::string& file, std::size_t keyframe_bytes, std::uint64_t seed) {
  const sim::PointsWorld world(world_options(keyframe_bytes, seed));
  auto writer = capture::KeyframeFileWriter::create(file).or_throw();
  for (std::uint32_t i = kLapFrames; i < world.size(); ++i) {
    Keyframe keyframe = world.keyframe(i);
    keyframe.T_odom_frame = world.T_world_frame(i);
    const std::size_t bytes = encode_keyframe(keyframe).size();
    if (bytes < keyframe_bytes)
      keyframe.picture =
          make_picture(keyframe.session.camera, std::min(keyframe_bytes - bytes, kMaxKeyframePictureBytes), seed + i);
    if (Status s = writer.write(keyframe); !s.ok()) throw StatusError(s);
  }
  if (Status s = writer.close(); !s.ok()) throw StatusError(s);
}

FleetLap::FleetLap(const std::string& file) {
  auto reader = capture::KeyframeFileReader::open(file).or_throw();
  SE3 T_world_previous;
  while (auto keyframe = reader.next().or_throw()) {
    const SE3 T_world_frame = keyframe->T_odom_frame;
    if (keyframe->sequence > kLapFrames) {
      steps_.push_back(T_world_previous.inverse() * T_world_frame);
      frames_.push_back(std::move(*keyframe));
    }
    T_world_previous = T_world_frame;
  }
  if (frames_.size() != kLapFrames) throw std::runtime_error(file + " is no lap of a fleet");
}

SessionHeader FleetLap::header(const FleetRobot& robot) {
  SessionHeader header;
  header.uuid = robot.uuid();
  header.robot = robot.name();
  header.name = "shift";
  header.camera = sim::PointsWorldOptions().camera;
  return header;
}

// From the lap's sequences to the robot's; what is older than the robot began with its first keyframe.
void FleetLap::continue_tracks(const FleetRobot& robot, std::uint32_t sequence, Keyframe& keyframe) const {
  const Keyframe& first = frames_[robot.start % kLapFrames];
  for (TrackMeasurement& z : keyframe.tracks) {
    const std::uint32_t age = keyframe.sequence - z.track.sequence;
    if (age <= sequence) {
      z.track.sequence = sequence - age;
      continue;
    }
    const auto same = std::find_if(first.tracks.begin(), first.tracks.end(), [&](const TrackMeasurement& begun) {
      return begun.track.index == z.track.index && first.sequence - begun.track.sequence == age - sequence;
    });
    if (same == first.tracks.end()) throw std::logic_error("a track of the lap comes from nowhere");
    z.track = {0, static_cast<std::uint32_t>(same - first.tracks.begin())};
  }
}

void FleetLap::add_noise(const FleetRobot& robot, Keyframe& keyframe) {
  sim::Stream noise(robot.seed, kPixel, robot.number, keyframe.sequence);
  const auto width = static_cast<float>(keyframe.session.camera.width - 1);
  const auto height = static_cast<float>(keyframe.session.camera.height - 1);
  const auto disturb = [&](float& value, float limit) {
    value = std::clamp(value + static_cast<float>(kPixelNoise * noise.normal()), 0.0F, limit);
  };
  for (TrackMeasurement& z : keyframe.tracks) {
    disturb(z.u_left, width);
    disturb(z.v, height);
    if (!std::isnan(z.u_right)) disturb(z.u_right, z.u_left);
  }
  for (AppearanceFeature& feature : keyframe.appearance) {
    if (feature.track >= 0) {
      const TrackMeasurement& z = keyframe.tracks[static_cast<std::size_t>(feature.track)];
      feature.u = z.u_left;
      feature.v = z.v;
      feature.disparity = z.u_left - z.u_right;
    } else {
      disturb(feature.u, width);
      disturb(feature.v, height);
    }
    sim::disturb_descriptor(feature.descriptor, kDescriptorNoise, noise);
  }
}

Keyframe FleetLap::keyframe(const FleetRobot& robot, std::uint32_t sequence, const SE3& T_odom_previous) const {
  const std::size_t phase = (robot.start + sequence) % kLapFrames;
  Keyframe keyframe = frames_[phase];
  keyframe.session = header(robot);
  continue_tracks(robot, sequence, keyframe);
  keyframe.sequence = sequence;
  keyframe.time_us = robot.time_us(sequence);
  keyframe.source = sequence == 0 ? MotionSource::kStart : MotionSource::kVision;
  keyframe.step_covariance.setZero();
  keyframe.driven_us = 0;
  keyframe.T_odom_frame = {};
  if (sequence > 0) {
    Vector6 xi;
    sim::Stream noise(robot.seed, kStep, robot.number, sequence);
    for (int k = 0; k < 6; ++k) xi[k] = noise.normal() * (k < 3 ? kStepNoiseM : kStepNoiseRad);
    keyframe.T_odom_frame = (T_odom_previous * steps_[phase] * SE3::exp(xi)).normalized();
    keyframe.step_covariance.diagonal().head<3>().setConstant(kStepNoiseM * kStepNoiseM);
    keyframe.step_covariance.diagonal().tail<3>().setConstant(kStepNoiseRad * kStepNoiseRad);
    keyframe.driven_us = robot.period_us;
  }

  add_noise(robot, keyframe);
  return keyframe;
}

}  // namespace relmap::bench
