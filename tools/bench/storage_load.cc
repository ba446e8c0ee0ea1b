#include "tools/bench/storage_load.h"

#include <algorithm>
#include <cmath>

namespace relmap::bench {

namespace {

constexpr std::uint32_t kMaxTrack = 12;  // keyframes
constexpr std::size_t kDescriptors = 4096;

// As the detector makes them: gradient histograms of 4 x 4 cells, many bins near nothing, none above 0.2 of the norm.
std::array<std::uint8_t, 128> random_descriptor(std::mt19937_64& random) {
  std::exponential_distribution<double> contrast(1.0);
  std::array<double, 128> bins{};
  double squares = 0;
  for (std::size_t cell = 0; cell < 16; ++cell) {
    const double strength = contrast(random);
    for (std::size_t bin = 0; bin < 8; ++bin) {
      double& value = bins[8 * cell + bin];
      value = strength * contrast(random) * contrast(random);
      squares += value * value;
    }
  }
  std::array<std::uint8_t, 128> descriptor{};
  for (std::size_t i = 0; i < bins.size(); ++i)
    descriptor[i] = static_cast<std::uint8_t>(512 * std::min(0.2, bins[i] / std::sqrt(squares)));
  return descriptor;
}

}  // namespace

KeyframeLoad::KeyframeLoad(LoadSize size, std::uint64_t seed) : size_(size), random_(seed) {
  for (std::uint8_t& byte : header_.uuid.bytes) byte = static_cast<std::uint8_t>(random_());
  header_.robot = "bench";
  header_.name = "storage";
  header_.camera = {500, 320, 240, 0.25, 640, 480};
  if (size_.features > 0)
    for (std::size_t i = 0; i < kDescriptors; ++i) descriptors_.push_back(random_descriptor(random_));
  for (std::uint32_t i = 0; i < size_.thumbnail_bytes; ++i) thumbnail_.push_back(static_cast<std::uint8_t>(random_()));
}

Keyframe KeyframeLoad::next() {
  std::uniform_real_distribution<float> u(40, 600), v(20, 460), disparity(1, 30), drift(-20, 20), noise(-0.5F, 0.5F);
  std::normal_distribution<double> step(0, 0.01);
  Keyframe k;
  k.session = header_;
  k.sequence = sequence_;
  k.time_us = 1'700'000'000'000'000 + std::int64_t{sequence_} * 500'000;
  if (sequence_ > 0) {
    const Vector3 rotation(step(random_), step(random_), step(random_));
    const Vector3 translation(step(random_), step(random_), 0.5 + step(random_));
    Vector6 twist;
    twist << translation, rotation;
    pose_ = (pose_ * SE3::exp(twist)).normalized();
    k.source = MotionSource::kVision;
    Matrix6 root = Matrix6::Zero();
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column <= row; ++column)
        root(row, column) = (row < 3 ? 1e-2 : 1e-3) * (row == column ? 1 : step(random_) * 20);
    k.step_covariance = root * root.transpose();
    k.driven_us = 500'000;
  }
  k.T_odom_frame = pose_;

  std::shuffle(tracks_.begin(), tracks_.end(), random_);
  std::erase_if(tracks_, [&](const TrackMeasurement& z) { return z.track.sequence + kMaxTrack <= sequence_; });
  const std::uint32_t kept = sequence_ == 0 ? 0 : size_.observations - size_.landmarks;
  if (tracks_.size() > kept) tracks_.resize(kept);
  for (TrackMeasurement& z : tracks_) {
    const float d = z.u_left - z.u_right;
    z.u_left = std::clamp(z.u_left + drift(random_), 40.0F, 600.0F);
    z.v = std::clamp(z.v + drift(random_), 0.0F, 479.0F);
    z.u_right = z.u_left - std::clamp(d + noise(random_), 0.5F, 39.0F);
  }
  for (std::uint32_t index = 0; tracks_.size() < size_.observations; ++index) {
    TrackMeasurement z;
    z.track = {sequence_, index};
    z.u_left = u(random_);
    z.v = v(random_);
    z.u_right = z.u_left - disparity(random_);
    z.level = static_cast<std::uint8_t>(index % 3);
    tracks_.push_back(z);
  }
  std::sort(tracks_.begin(), tracks_.end(), [](const auto& l, const auto& r) { return l.track < r.track; });
  k.tracks = tracks_;

  k.appearance.resize(size_.features);
  for (AppearanceFeature& feature : k.appearance) {
    feature.u = u(random_);
    feature.v = v(random_);
    feature.disparity = disparity(random_);
    feature.scale = disparity(random_);
    feature.angle = noise(random_);
    feature.descriptor = descriptors_[random_() % descriptors_.size()];
  }
  k.picture = thumbnail_;
  ++sequence_;
  return k;
}

namespace {

storage::Landmark start_landmark(const StereoCamera& camera, const TrackMeasurement& z) {
  storage::Landmark landmark;
  landmark.track = z.track;
  landmark.abr = {(z.u_left - camera.cx) / camera.f, (z.v - camera.cy) / camera.f,
                  (z.u_left - z.u_right) / (camera.f * camera.baseline)};
  return landmark;
}

storage::Edge odometry_edge(FrameId previous, const storage::FrameHot& previous_hot, FrameId id,
                            const Keyframe& keyframe) {
  storage::Edge edge;
  edge.id = {id, 0};
  edge.a = previous;
  edge.b = id;
  edge.T_ab = edge.prior_T_ab = (previous_hot.T_odom_frame.inverse() * keyframe.T_odom_frame).normalized();
  edge.covariance = edge.prior_covariance = keyframe.step_covariance;
  for (std::size_t k = 0; k < 36; ++k)  // as after a relaxation; no two alike
    edge.correlation_with_previous[k] = static_cast<std::int8_t>((id.index * 37 + k * 11) % 80);
  edge.driven_s = static_cast<float>(static_cast<double>(keyframe.driven_us) * 1e-6);
  return edge;
}

}  // namespace

void add_frame(storage::Map& map, SessionNumber number, std::uint64_t journal_sequence, std::uint32_t crc,
               Keyframe keyframe) {
  const FrameId id{number, keyframe.sequence};
  storage::FrameHot hot;
  hot.present = true;
  hot.time_us = keyframe.time_us;
  hot.journal_sequence = journal_sequence;
  hot.payload_crc = crc;
  hot.T_odom_frame = keyframe.T_odom_frame;
  hot.appearance_count = static_cast<std::uint32_t>(keyframe.appearance.size());
  storage::FrameWarm warm;
  warm.observations.reserve(keyframe.tracks.size());
  std::vector<std::uint32_t> born;  // sequence of the base of each older track seen
  for (const TrackMeasurement& z : keyframe.tracks) {
    const LandmarkId landmark{{number, z.track.sequence}, z.track.index};
    warm.observations.push_back({landmark, {}, z.u_left, z.v, z.u_right, z.level});
    if (z.track.sequence == keyframe.sequence) {
      hot.landmarks.push_back(start_landmark(keyframe.session.camera, z));
      hot.landmarks.back().observers.push_back(id);
    } else {
      map.edit_hot(landmark.base).landmarks[landmark.slot].observers.push_back(id);
      born.push_back(z.track.sequence);
    }
  }
  if (keyframe.sequence > 0) {
    const FrameId previous{number, keyframe.sequence - 1};
    storage::FrameHot& before = map.edit_hot(previous);
    before.incoming.push_back({id, 0});
    hot.edges.push_back(odometry_edge(previous, before, id, keyframe));
    std::sort(born.begin(), born.end());
    std::uint32_t through = 0;  // tracks born before the edge that is looked at
    for (std::uint32_t to = born.empty() ? keyframe.sequence : born.front() + 1; to <= keyframe.sequence; ++to) {
      while (through < born.size() && born[through] < to) ++through;
      storage::Edge& edge = to == keyframe.sequence ? hot.edges.front() : map.edit_hot({number, to}).edges.front();
      edge.support += through;
      edge.prior_active = edge.support < storage::kMinSupport;
    }
  }
  storage::FrameCold cold;
  cold.words.reserve(keyframe.appearance.size());
  for (const AppearanceFeature& feature : keyframe.appearance) {
    std::uint32_t word = 0;  // stands for a word: a number below 10,000 that depends on the descriptor
    for (std::size_t i = 0; i < 8; ++i) word = word * 31 + feature.descriptor[16 * i];
    cold.words.push_back(word % 10000);
  }
  cold.appearance = std::move(keyframe.appearance);
  cold.picture = std::move(keyframe.picture);
  map.add_frame(id, std::move(hot), std::move(warm), std::move(cold));

  storage::Session& session = map.edit_session(number);
  if (session.frames == 0) session.first = id.index, session.first_time_us = keyframe.time_us;
  session.last = id.index;
  session.last_time_us = keyframe.time_us;
  session.next_sequence = id.index + 1;
  ++session.frames;
  ++map.state().keyframes;
  map.state().applied_sequence = journal_sequence;
}

}  // namespace relmap::bench
