// A map as the daemon makes it, in any engine: two laps of a circle, with closures, appearance and a label, committed
// now and then so that it has closed and open chunks. Also what verify says of a map.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/map/derived.h"
#include "server/map/testing/points_drive.h"
#include "storage/maintenance/repair.h"
#include "storage/maintenance/verify.h"

namespace relmap::storage {

inline constexpr std::uint32_t kDrivenFrames = 150, kDrivenLap = 100, kDrivenFeatures = 3;

inline void drive_map(const std::shared_ptr<Engine>& engine, std::uint32_t frames = kDrivenFrames) {
  sim::PointsWorldOptions options;
  options.frames = frames;
  options.frames_per_lap = kDrivenLap;
  options.appearance = kDrivenFeatures;
  map::PointsDrive drive(engine);
  drive.drive(sim::PointsWorld(options), frames, [&](std::uint32_t i) {
    EXPECT_TRUE(i % 40 != 39 || drive.map().commit().ok());
    return i % 3 == 0;
  });
  drive.map().set_label({map::kDriveSession, 7}, "kitchen", true);
  EXPECT_TRUE(drive.map().commit().ok());
}

struct Verified {
  VerifySummary summary;
  std::vector<std::string> findings;

  bool names(const std::string& what) const {
    for (const std::string& finding : findings)
      if (finding.find(what) != std::string::npos) return true;
    return false;
  }
};

inline Verified verified(const EngineSnapshot& snapshot, const VerifyOptions& options = {}) {
  Verified result;
  result.summary =
      verify(snapshot, options, [&](const Finding& finding) { result.findings.push_back(finding.what); }, {})
          .or_throw();
  EXPECT_EQ(result.summary.findings, result.findings.size());
  return result;
}

inline std::unique_ptr<Map> open_map(const std::shared_ptr<Engine>& engine) {
  return Map::open(engine, engine->acquire().or_throw(), std::make_shared<Budget>(std::size_t{256} << 20)).or_throw();
}

}  // namespace relmap::storage
