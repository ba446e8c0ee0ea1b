// Maps of known shape for tests of layouts: robots that wander, each part of the map by itself.
#pragma once

#include <cmath>
#include <memory>
#include <random>

#include "client/skeleton_relaxation.h"
#include "tools/console/layout/make_layout.h"
#include "tools/console/layout/tile_index.h"

namespace relmap::console::testing {

struct DrawnMap {
  std::uint32_t seed = 1;
  std::uint32_t parts = 2, sessions = 3;  // of each part
  std::uint32_t points = 200;             // of each session
  std::uint32_t every = 4;                // frames a point
  double step = 3;                        // metres between points
  std::uint32_t closures = 40;            // of each part
};

struct DrawnSkeleton {
  client::Skeleton skeleton;
  client::RelaxedSkeleton relaxed;
};

inline SE3 driven(double x, double z, double heading) { return {so3_exp({0, heading, 0}), {x, 0, z}}; }

inline DrawnSkeleton draw_skeleton(const DrawnMap& map) {
  std::mt19937 random(map.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  DrawnSkeleton drawn;
  drawn.skeleton.map_version = 7;
  drawn.skeleton.commit_number = 3;
  SessionNumber session = 0;
  for (std::uint32_t p = 0; p < map.parts; ++p) {
    auto& part = drawn.relaxed.parts.emplace_back();
    const std::uint32_t sessions = map.sessions + map.parts - p;  // the largest first
    std::vector<client::RelaxedSkeleton::Place> places;
    for (std::uint32_t s = 0; s < sessions; ++s) {
      auto& chain = drawn.skeleton.chains.emplace_back();
      chain.session = ++session;
      double x = 30 * uniform(random), z = 30 * uniform(random), heading = 6 * uniform(random), bend = 0;
      for (std::uint32_t i = 0; i < map.points; ++i) {
        auto& point = chain.points.emplace_back();
        point.frame = {session, 10 + i * map.every};
        point.time_us = 1'700'000'000'000'000 + std::int64_t{session} * 3'600'000'000 + std::int64_t{i} * 1'000'000;
        const SE3 pose = driven(x, z, heading);
        if (i > 0) {
          point.T_before_this = places.back().T_root_frame.inverse() * pose;
          point.translation_variance = 1e-3 * map.step;
          point.rotation_variance = 1e-5;
          point.frames = map.every;
          point.unmeasured = uniform(random) < 0.03;
        }
        places.push_back({point.frame, pose});
        bend = 0.7 * bend + 0.3 * (uniform(random) - 0.5);
        heading += bend;
        x += map.step * std::sin(heading);
        z += map.step * std::cos(heading);
      }
    }
    part.root = places.front().frame;
    part.places = places;
    for (std::uint32_t c = 0; c < map.closures; ++c) {
      auto& closure = drawn.skeleton.closures.emplace_back();
      const auto& a = places[static_cast<std::size_t>(uniform(random) * static_cast<double>(places.size() / 2))];
      const auto& b = places[places.size() / 2 +
                             static_cast<std::size_t>(uniform(random) * static_cast<double>(places.size() / 2 - 1))];
      closure.id = {b.frame, c + 1};
      closure.a = a.frame;
      closure.state = c % 5 == 0 ? client::EdgeState::kCandidate : client::EdgeState::kAccepted;
      closure.carries = c % 5 != 1;
      closure.T_ab = a.T_root_frame.inverse() * b.T_root_frame;
      if (c == 7) closure.T_ab.t.x() += 5;  // what the others contradict
      closure.translation_variance = closure.rotation_variance = 3e-2;
      closure.suspicion = uniform(random);
    }
  }
  drawn.skeleton.frames = 0;
  for (const auto& chain : drawn.skeleton.chains)
    for (const auto& point : chain.points) drawn.skeleton.frames += point.frames == 0 ? 1 : point.frames;
  drawn.skeleton.frames_done = drawn.skeleton.frames;
  drawn.relaxed.springs = client::springs_of(drawn.skeleton);
  return drawn;
}

inline std::shared_ptr<const MapLayout> draw_layout(const DrawnMap& map, const MapLayout* before = nullptr) {
  const DrawnSkeleton drawn = draw_skeleton(map);
  MapLayout layout = make_layout(drawn.skeleton, drawn.relaxed, before);
  layout.version = before ? before->version + 1 : 1;
  layout.map = {Uuid{{1, 2, 3}}, 5};
  layout.boot_id = "boot";
  return std::make_shared<const MapLayout>(std::move(layout));
}

}  // namespace relmap::console::testing
