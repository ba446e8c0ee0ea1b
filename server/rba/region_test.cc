#include "server/rba/region.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>

#include "tests/support/simulated_drive.h"

namespace relmap::rba {
namespace {

// Regions of a circle that has been driven.
class DrivenRegionTest : public ::testing::Test {
 protected:
  DrivenRegionTest(std::uint32_t frames, std::uint32_t frames_per_lap, double mono_share)
      : drive_(world(frames, frames_per_lap, mono_share), RbaOptions()) {
    drive_.drive();
  }

  testing::SimulatedDrive drive_;
  LocalMap local_{drive_.map()};
  Region region_{local_, 1.0 / 9};
  Problem problem_;

 private:
  static sim::PointsWorldOptions world(std::uint32_t frames, std::uint32_t frames_per_lap, double mono_share) {
    sim::PointsWorldOptions options;
    options.frames = frames;
    options.frames_per_lap = frames_per_lap;
    options.mono_share = mono_share;
    return options;
  }
};

class RegionTest : public DrivenRegionTest {
 protected:
  RegionTest() : DrivenRegionTest(75, 60, 0.2) {}
};

TEST_F(RegionTest, AnEdgeMovesIffOneOfItsEndsIsActive) {
  for (const std::uint32_t i : {65U, 66U, 67U}) region_.activate(local_.frame(drive_.frame(i)));
  region_.build(&problem_);
  std::set<EdgeId> moving;
  for (std::int32_t c = 0; c < problem_.columns; ++c) {
    const storage::LocalEdge& edge = local_.edges[region_.edge_of_column(c)];
    EXPECT_TRUE(region_.is_active(edge.a) || region_.is_active(edge.b));
    moving.insert(edge.id);
  }
  for (const std::uint32_t i : {65U, 66U, 67U, 68U}) EXPECT_TRUE(moving.contains({drive_.frame(i), 0})) << i;
  EXPECT_FALSE(moving.contains({drive_.frame(64), 0}));
  EXPECT_FALSE(moving.contains({drive_.frame(69), 0}));
}

TEST_F(RegionTest, IsClosedUnderThePathsOfItsObservations) {
  for (const std::uint32_t i : {3U, 62U, 63U, 64U}) region_.activate(local_.frame(drive_.frame(i)));
  region_.build(&problem_);
  // Every observation that a step of the solver could change belongs to a free landmark.
  std::size_t checked = 0;
  for (const ProblemBase& base : problem_.bases) {
    for (std::int32_t l = base.end_free; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem_.landmarks[l];
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o)
        for (std::int32_t n = problem_.observations[o].node; problem_.nodes[n].parent >= 0;
             n = problem_.nodes[n].parent, ++checked)
          EXPECT_LT(problem_.edges[problem_.nodes[n].edge].column, 0);
    }
  }
  EXPECT_GT(checked, 100U);
  // Every observation of a free landmark is there.
  std::size_t seen = 0, stored = 0;
  for (const ProblemBase& base : problem_.bases)
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l)
      seen += static_cast<std::size_t>(problem_.landmarks[l].end_observation - problem_.landmarks[l].first_observation);
  for (const LocalLandmark& landmark : local_.landmarks)
    if (landmark.observers_loaded) stored += landmark.record->observers.size();
  EXPECT_EQ(seen, stored);
}

// By frame and pixel, the number of steps from the landmark's base to each counted observation, and that of moving
// ones.
std::map<std::pair<FrameId, double>, std::pair<int, int>> steps_of(const Problem& problem, const LocalMap& local) {
  std::map<std::pair<FrameId, double>, std::pair<int, int>> steps;
  for (const ProblemObservation& seen : problem.observations) {
    auto& [all, moving] = steps[{local.frames[seen.frame].id, seen.z.x()}];
    for (std::int32_t n = seen.node; problem.nodes[n].parent >= 0; n = problem.nodes[n].parent) {
      ++all;
      moving += problem.edges[problem.nodes[n].edge].column >= 0;
    }
    if (!seen.counted) all = -1;
  }
  return steps;
}

TEST_F(RegionTest, GrowsToTheProblemThatItWouldHaveMadeAtOnce) {
  for (const std::uint32_t i : {62U, 63U}) region_.activate(local_.frame(drive_.frame(i)));
  region_.build(&problem_);
  const auto before = steps_of(problem_, local_);
  for (const std::uint32_t i : {64U, 65U, 3U, 2U}) region_.activate(local_.frame(drive_.frame(i)));
  region_.build(&problem_);
  const auto grown = steps_of(problem_, local_);
  EXPECT_GT(grown.size(), before.size());

  // Cleared, it makes another map's problem, and then the same at once.
  for (const bool same : {false, true}) {
    region_.clear();
    local_.clear();
    for (const std::uint32_t i : {62U, 63U, 64U, 65U, 3U, 2U})
      region_.activate(local_.frame(drive_.frame(same ? i : i / 2 + 5)));
    region_.build(&problem_);
    EXPECT_EQ(steps_of(problem_, local_) == grown, same);
  }
}

// Where measurements hold an edge, the robot's own step counts a ninth, and may be outvoted.
TEST_F(RegionTest, MovingEdgesThatFewMeasurementsHoldKeepTheirPrior) {
  for (std::uint32_t i = 60; i < 70; ++i) region_.activate(local_.frame(drive_.frame(i)));
  region_.build(&problem_);
  std::vector<std::int32_t> uses(problem_.edges.size(), 0);
  for (const ProblemBase& base : problem_.bases)
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l)
      for (std::int32_t o = problem_.landmarks[l].first_observation; o < problem_.landmarks[l].end_observation; ++o)
        for (std::int32_t n = problem_.observations[o].node; problem_.nodes[n].parent >= 0;
             n = problem_.nodes[n].parent)
          uses[problem_.nodes[n].edge] += problem_.observations[o].counted;
  for (std::size_t e = 0; e < problem_.edges.size(); ++e) {
    const ProblemEdge& edge = problem_.edges[e];
    if (edge.column >= 0) {
      EXPECT_TRUE((edge.prior && !edge.prior_doubted) || uses[e] >= static_cast<std::int32_t>(storage::kMinSupport));
    }
  }
  EffectiveSupport support;
  support.compute(problem_);
  int with = 0, without = 0;
  for (const ProblemEdge& edge : problem_.edges) {
    if (edge.column < 0) continue;
    const storage::Edge& record = *local_.edges[static_cast<std::size_t>(region_.edge_of_column(edge.column))].record;
    const bool measured = support.of(edge.column) >= storage::kMinSupport;
    if (measured && record.kind == storage::EdgeKind::kLoop) {
      EXPECT_FALSE(edge.prior) << "a loop edge is free once observations hold it";
      continue;
    }
    EXPECT_TRUE(edge.prior);
    EXPECT_EQ(edge.prior_doubted, measured);
    const Matrix6 ratio = edge.prior_information * record.prior_covariance;
    EXPECT_LT((ratio - (measured ? 1.0 / 9 : 1.0) * Matrix6::Identity()).norm(), 1e-6);
    ++(edge.prior_doubted ? without : with);
  }
  EXPECT_GT(with, 0);
  EXPECT_GT(without, 5);
}

TEST_F(RegionTest, MonoPointsWithoutParallaxHaveADepthPrior) {
  for (std::uint32_t i = 20; i < 30; ++i) region_.activate(local_.frame(drive_.frame(i)));
  region_.build(&problem_);
  int with = 0, without = 0;
  for (const ProblemBase& base : problem_.bases)
    for (std::int32_t l = base.first_landmark; l < base.end_free; ++l) {
      const ProblemLandmark& point = problem_.landmarks[l];
      bool stereo = false;
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o)
        stereo = stereo || !problem_.observations[o].mono;
      const auto seen = point.end_observation - point.first_observation;
      if (stereo) {
        EXPECT_FALSE(point.depth_prior);
        continue;
      }
      if (seen == 1) {
        EXPECT_TRUE(point.depth_prior);
      }
      ++(point.depth_prior ? with : without);
    }
  EXPECT_GT(with, 3);
  EXPECT_GT(without, 3);
}

TEST_F(RegionTest, CovariancesAreTakenFarFromTheBoundaryOnly) {
  for (std::uint32_t i = 67; i < 75; ++i) region_.activate(local_.frame(drive_.frame(i)));
  region_.build(&problem_);
  std::vector<char> far;
  region_.far_from_boundary(problem_, 5, &far);
  std::vector<char> near;
  region_.far_from_boundary(problem_, 0, &near);
  std::set<EdgeId> believed;
  for (std::int32_t c = 0; c < problem_.columns; ++c) {
    EXPECT_TRUE(near[c]);
    if (far[c]) believed.insert(local_.edges[region_.edge_of_column(c)].id);
  }
  for (const EdgeId id : believed) EXPECT_GE(id.frame.index, 70U);
}

// A circle driven ten times: the landmarks that the first laps saw are fixed.
class FixedRegionTest : public DrivenRegionTest {
 protected:
  static constexpr std::uint32_t kLap = 40, kFrames = 397;
  FixedRegionTest() : DrivenRegionTest(kFrames, kLap, 0) {}

  void build(std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t i = first; i < end; ++i) region_.activate(local_.frame(drive_.frame(i)));
    region_.build(&problem_);
  }
  bool crosses_moving_edge(const ProblemObservation& seen) const {
    for (std::int32_t n = seen.node; problem_.nodes[n].parent >= 0; n = problem_.nodes[n].parent)
      if (problem_.edges[problem_.nodes[n].edge].column >= 0) return true;
    return false;
  }
};

TEST_F(FixedRegionTest, FixedLandmarksAreHeldAndMeasureTheEdgesThatMove) {
  build(kFrames - 20, kFrames - 12);
  std::size_t across = 0, own = 0;
  for (const ProblemBase& base : problem_.bases)
    for (std::int32_t l = base.first_landmark; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem_.landmarks[l];
      for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
        const ProblemObservation& seen = problem_.observations[o];
        if (l < base.end_free) {
          EXPECT_TRUE(seen.counted);
          continue;
        }
        EXPECT_EQ(seen.counted, crosses_moving_edge(seen));
        across += seen.counted && !region_.is_active(seen.frame);
        own += seen.counted && region_.is_active(seen.frame);
      }
    }
  EXPECT_GT(own, 8U * 15);
  EXPECT_GT(across, 0U) << "frames next to the active ones reach the map across them";
  for (const LocalLandmark& landmark : local_.landmarks) EXPECT_FALSE(landmark.fixed && landmark.observers_loaded);
}

TEST_F(FixedRegionTest, CovariancesAreNotTakenNextToAStaticFrame) {
  build(kFrames - 8, kFrames);
  std::vector<char> far;
  region_.far_from_boundary(problem_, 5, &far);
  std::size_t believed = 0;
  for (std::int32_t c = 0; c < problem_.columns; ++c) {
    if (!far[c]) continue;
    ++believed;
    EXPECT_GE(local_.edges[region_.edge_of_column(c)].id.frame.index, kFrames - 4);
  }
  EXPECT_GT(believed, 0U);
}

TEST_F(FixedRegionTest, FramesOfTheFirstPassesAreFixedAndThoseOfLaterPassesAreNot) {
  std::size_t fixed = 0;
  for (std::uint32_t i = 0; i < kLap; ++i) fixed += local_.frame_is_fixed(local_.frame(drive_.frame(i)));
  EXPECT_GT(fixed, 30U);
  for (std::uint32_t i = kFrames - kLap; i < kFrames; ++i)
    EXPECT_FALSE(local_.frame_is_fixed(local_.frame(drive_.frame(i)))) << i;
}

TEST_F(FixedRegionTest, TheFullSolutionHoldsNothing) {
  region_.hold_fixed(false);
  build(0, kFrames);
  for (const ProblemBase& base : problem_.bases) EXPECT_EQ(base.end_free, base.end_landmark);
  for (const ProblemObservation& seen : problem_.observations) EXPECT_TRUE(seen.counted);
}

}  // namespace
}  // namespace relmap::rba
