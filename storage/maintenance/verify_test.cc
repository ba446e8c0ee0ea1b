#include "storage/maintenance/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "server/map/derived.h"
#include "server/map/testing/points_drive.h"

namespace relmap {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Verified {
  VerifySummary summary;
  std::vector<Finding> findings;

  std::vector<std::string> words() const {
    std::vector<std::string> words;
    for (const Finding& finding : findings) words.push_back(finding.what);
    return words;
  }
  bool names(const std::string& part) const {
    for (const Finding& finding : findings)
      if (finding.what.find(part) != std::string::npos) return true;
    return false;
  }
};

Verified verified(const EngineSnapshot& snapshot, const VerifyOptions& options = {}) {
  Verified result;
  result.summary =
      verify(snapshot, options, [&](const Finding& finding) { result.findings.push_back(finding); }, {}).or_throw();
  EXPECT_EQ(result.summary.findings, result.findings.size());
  return result;
}

// Two laps of a circle, with closures: committed now and then, so that closed and open chunks are among it.
class DrivenMap : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 150, kLap = 100;

  void SetUp() override {
    sim::PointsWorldOptions options;
    options.frames = kFrames;
    options.frames_per_lap = kLap;
    options.appearance = 3;
    drive.drive(sim::PointsWorld(options), kFrames, [&](std::uint32_t i) {
      if (i % 40 == 39) commit();
      return i % 3 == 0;
    });
    drive.map().set_label({1, 7}, "kitchen", true);
    commit();
  }
  void commit() { ASSERT_TRUE(drive.map().commit().ok()); }
  std::shared_ptr<const EngineSnapshot> snapshot() { return drive.map().view()->committed(); }

  PointsDrive drive;
};

TEST_F(DrivenMap, NothingIsFoundInASoundMap) {
  const Verified found = verified(*snapshot());
  EXPECT_THAT(found.words(), IsEmpty());
  EXPECT_TRUE(found.summary.complete);
  EXPECT_EQ(found.summary.sessions, 1u);
  EXPECT_EQ(found.summary.frames, kFrames);
  EXPECT_EQ(found.summary.features, 3 * kFrames);
  EXPECT_GT(found.summary.edges, kFrames);
  EXPECT_GT(found.summary.observations, found.summary.landmarks);
  EXPECT_GT(drive.map().state().closures_accepted, 0u);
}

}  // namespace
}  // namespace relmap
