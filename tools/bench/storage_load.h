// Keyframes of realistic size and random content, as of a robot that drives for ever, and a map made of them by
// storage's own API: the work of the worker without place recognition and relaxation.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "proto/keyframe/keyframe.h"
#include "storage/map/map.h"

namespace relmap::bench {

struct LoadSize {
  std::uint32_t observations = 120;  // a keyframe's
  std::uint32_t landmarks = 40;      // new ones among them
  std::uint32_t features = 300;      // of its appearance
  std::uint32_t thumbnail_bytes = 1500;
};
inline constexpr LoadSize kLightLoad = {45, 12, 0, 0};

class KeyframeLoad {
 public:
  KeyframeLoad(LoadSize size, std::uint64_t seed);

  const SessionHeader& header() const { return header_; }
  // Of ascending sequences from 0.
  Keyframe next();

 private:
  std::array<std::uint8_t, 128> descriptor();

  LoadSize size_;
  std::mt19937_64 random_;
  SessionHeader header_;
  std::uint32_t sequence_ = 0;
  SE3 pose_;
  std::vector<TrackMeasurement> tracks_;  // of the last keyframe
  std::vector<std::array<std::uint8_t, 128>>
      descriptors_;  // reused, since drawing a new one takes longer than storing it
  Bytes thumbnail_;
};

// Adds a keyframe's frame with its odometry edge, landmarks and observations, and updates what depends on it: observers
// of older landmarks, and the support of the edges in between.
void add_frame(storage::Map& map, SessionNumber session, std::uint64_t journal_sequence, std::uint32_t crc,
               Keyframe keyframe);

}  // namespace relmap::bench
