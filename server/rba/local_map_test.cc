#include "server/rba/local_map.h"

#include <gtest/gtest.h>

#include <map>
#include <span>

#include "storage/graph/binding.h"
#include "tests/support/simulated_drive.h"

namespace relmap::rba {
namespace {

// A circle of 60 frames driven one and a half times: loop edges, claims, and bindings.
sim::PointsWorldOptions one_and_a_half_laps() {
  sim::PointsWorldOptions options;
  options.frames = 90;
  options.frames_per_lap = 60;
  return options;
}
const testing::SimulatedDrive& looped() {
  static testing::SimulatedDrive* drive = [] {
    auto* made = new testing::SimulatedDrive(one_and_a_half_laps(), RbaOptions());
    made->drive();
    return made;
  }();
  return *drive;
}
// One of its second lap; invalid if there is none.
ClosureId accepted_closure(testing::SimulatedDrive& drive) {
  for (std::uint32_t i = 60; i < drive.driven(); ++i)
    for (const storage::Edge& edge : drive.map().hot(drive.frame(i))->edges)
      if (edge.kind == storage::EdgeKind::kLoop && edge.state == storage::EdgeState::kAccepted) return edge.id;
  return {};
}
const storage::Graph& graph() { return const_cast<testing::SimulatedDrive&>(looped()).map(); }

TEST(LocalMap, ObservationsMeanTheLandmarksInForce) {
  LocalMap local(graph());
  std::size_t aliases = 0;
  for (std::uint32_t i = 0; i < looped().driven(); ++i) {
    const std::int32_t frame = local.frame(looped().frame(i));
    local.load_observations(frame);
    const auto warm = graph().warm(looped().frame(i));
    ASSERT_EQ(local.view(frame).end - local.view(frame).first, static_cast<std::int32_t>(warm->observations.size()));
    for (std::size_t k = 0; k < warm->observations.size(); ++k) {
      const LocalObservation& seen = local.observations[static_cast<std::size_t>(local.view(frame).first) + k];
      const LandmarkId expected = storage::resolve(graph(), warm->observations[k].landmark);
      EXPECT_EQ(local.landmarks[seen.landmark].id, expected);
      EXPECT_EQ(local.frames[local.landmarks[seen.landmark].base].id, expected.base);
      aliases += expected != warm->observations[k].landmark;
    }
  }
  EXPECT_GT(aliases, 100U);
}

TEST(LocalMap, TracksBoundByAClosureMeasureWorse) {
  LocalMap local(graph());
  std::map<double, int> tracked, claimed;  // by information
  for (std::uint32_t i = 0; i < looped().driven(); ++i) {
    const std::int32_t frame = local.frame(looped().frame(i));
    local.load_observations(frame);
    const auto warm = graph().warm(looped().frame(i));
    for (std::size_t k = 0; k < warm->observations.size(); ++k) {
      const LocalObservation& seen = local.observations[static_cast<std::size_t>(local.view(frame).first) + k];
      const storage::Observation& record = warm->observations[k];
      ASSERT_FALSE(record.origin.valid());
      (local.landmarks[seen.landmark].id == record.landmark ? tracked : claimed)[seen.information]++;
    }
  }
  // This world measures all on one level.
  ASSERT_EQ(tracked.size(), 1U);
  ASSERT_EQ(claimed.size(), 1U);
  EXPECT_DOUBLE_EQ(tracked.begin()->first, 9 * claimed.begin()->first);
}

TEST(LocalMap, KeypointsWithoutATrackMeasureWorst) {
  testing::SimulatedDrive drive(one_and_a_half_laps(), RbaOptions());
  drive.drive();
  const ClosureId closure = accepted_closure(drive);
  ASSERT_TRUE(closure.valid());
  auto& observations = drive.map().edit_warm(drive.frame(20)).observations;
  observations.push_back(observations.front());
  observations.back().origin = closure;

  LocalMap local(drive.map());
  const std::int32_t frame = local.frame(drive.frame(20));
  local.load_observations(frame);
  const LocalObservation& tracked = local.observations[static_cast<std::size_t>(local.view(frame).first)];
  const LocalObservation& keypoint = local.observations[static_cast<std::size_t>(local.view(frame).end) - 1];
  EXPECT_EQ(keypoint.landmark, tracked.landmark);
  EXPECT_DOUBLE_EQ(tracked.information, 64 * keypoint.information);
}

TEST(LocalMap, AlignedBindingsMeasureLikeTracksAndUnneededOnesAreIgnored) {
  testing::SimulatedDrive drive(one_and_a_half_laps(), RbaOptions());
  drive.drive();
  const ClosureId closure = accepted_closure(drive);
  ASSERT_TRUE(closure.valid());
  const auto view_of = [&](LocalMap& local) {
    const std::int32_t frame = local.frame(drive.frame(20));
    local.load_observations(frame);
    return std::span(local.observations).subspan(static_cast<std::size_t>(local.view(frame).first));
  };
  auto& observations = drive.map().edit_warm(drive.frame(20)).observations;
  observations.push_back(observations.front());
  observations.back().origin = closure;
  observations.back().aligned = true;
  LocalMap local(drive.map());
  const auto seen = view_of(local);
  ASSERT_EQ(seen.size(), observations.size());
  EXPECT_EQ(seen.back().landmark, seen.front().landmark);
  EXPECT_DOUBLE_EQ(seen.back().information, seen.front().information);

  const LandmarkId first = observations.front().landmark;
  drive.map().edit_hot(first.base).landmarks[first.slot].claims.push_back({{}, closure});
  LocalMap without(drive.map());
  EXPECT_EQ(view_of(without).size(), observations.size() - 2);
}

TEST(LocalMap, ServesOneRelaxationAfterAnother) {
  LocalMap again(graph());
  for (std::uint32_t i = 0; i < looped().driven(); i += 9) {
    LocalMap fresh(graph());
    again.clear();
    for (LocalMap* local : {&again, &fresh}) {
      std::vector<std::int32_t> frames;
      local->nearest(local->frame(looped().frame(i)), 12, &frames);
      for (const std::int32_t frame : frames) local->load_observations(frame);
    }
    ASSERT_EQ(again.frames.size(), fresh.frames.size());
    for (std::size_t f = 0; f < fresh.frames.size(); ++f) EXPECT_EQ(again.frames[f].id, fresh.frames[f].id);
    ASSERT_EQ(again.edges.size(), fresh.edges.size());
    for (std::size_t e = 0; e < fresh.edges.size(); ++e) EXPECT_EQ(again.edges[e].id, fresh.edges[e].id);
    ASSERT_EQ(again.landmarks.size(), fresh.landmarks.size());
    for (std::size_t l = 0; l < fresh.landmarks.size(); ++l) EXPECT_EQ(again.landmarks[l].id, fresh.landmarks[l].id);
    EXPECT_EQ(again.observations.size(), fresh.observations.size());
  }
}

TEST(LocalMap, UnknownFramesHaveNoIndex) {
  LocalMap local(graph());
  EXPECT_EQ(local.frame({1, 100000}), -1);
  EXPECT_EQ(local.frame({7, 0}), -1);
}

}  // namespace
}  // namespace relmap::rba
