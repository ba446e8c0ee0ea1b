#include "server/map/map_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/derived.h"
#include "server/map/edge_edit.h"
#include "server/map/testing/comparison.h"
#include "server/map/testing/one_eye.h"
#include "server/map/testing/points_drive.h"
#include "server/map/tracks.h"
#include "storage/graph/binding.h"
#include "storage/graph/local_graph.h"
#include "storage/graph/observers.h"

namespace relmap::map {
namespace {

sim::PointsWorldOptions laps(std::uint32_t frames, std::uint32_t frames_per_lap) {
  sim::PointsWorldOptions options;
  options.frames = frames;
  options.frames_per_lap = frames_per_lap;
  options.births = 30;  // as many as a real front-end tracks
  return options;
}

const auto kNever = [](std::uint32_t) { return false; };
const auto kAlways = [](std::uint32_t) { return true; };

std::size_t count_edges(const storage::Graph& graph, std::uint32_t frames,
                        const std::function<bool(const storage::Edge&)>& which) {
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < frames; ++i)
    for (const storage::Edge& edge : graph.hot({kDriveSession, i})->edges) count += which(edge);
  return count;
}
bool accepted_loop(const storage::Edge& e) {
  return e.kind == storage::EdgeKind::kLoop && e.state == storage::EdgeState::kAccepted;
}

TEST(MapBuilder, TracksBecomeLandmarksInTheFrameThatSawThemFirst) {
  const sim::PointsWorld world(laps(40, 100));
  PointsDrive drive;
  drive.drive(world, 40, kNever);
  for (std::uint32_t i = 0; i < 40; ++i) {
    const Keyframe keyframe = world.keyframe(i);
    const auto warm = drive.map().warm({kDriveSession, i});
    ASSERT_EQ(warm->observations.size(), keyframe.tracks.size());
    for (std::size_t n = 0; n < keyframe.tracks.size(); ++n) {
      const LandmarkId id = warm->observations[n].landmark;
      const storage::Landmark& landmark = drive.map().hot(id.base)->landmarks[id.slot];
      EXPECT_EQ(landmark.track, keyframe.tracks[n].track);
      EXPECT_LE(i - id.base.index, storage::kPathDepth);
    }
  }
}

TEST(MapBuilder, DerivedFactsStayInStepThroughALapWithClosures) {
  const sim::PointsWorld world(laps(90, 60));
  PointsDrive drive;
  drive.drive(world, 90, kAlways);
  EXPECT_GT(count_edges(drive.map(), 90, accepted_loop), 20u);
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
}

TEST(MapBuilder, MonoFramesHaveNoEdges) {
  sim::PointsWorldOptions options = laps(30, 60);
  options.appearance = 40;
  const sim::PointsWorld world(options);
  PointsDrive drive;
  drive.apply(storage::SessionRecord{2, "one eye", with_one_eye(world.keyframe(0)).session});
  for (std::uint32_t i = 0; i < 30; ++i) {
    const Keyframe keyframe = with_one_eye(world.keyframe(i));
    ASSERT_TRUE(check_keyframe(keyframe).ok()) << check_keyframe(keyframe).to_string();
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    drive.apply(storage::KeyframeRecord{2, crc, std::move(payload)});
    const auto hot = drive.map().hot({2, i});
    ASSERT_TRUE(hot);
    EXPECT_TRUE(hot->edges.empty() && hot->incoming.empty() && hot->landmarks.empty());
    EXPECT_EQ(drive.map().cold({2, i})->appearance.size(), keyframe.appearance.size());
  }
  EXPECT_EQ(drive.map().session(2)->frames, 30u);
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
}

// Driven round and round, each lap recognised in the first.
void drive_laps(PointsDrive& drive, const sim::PointsWorld& world, std::uint32_t count) {
  const std::uint32_t lap = world.options().frames_per_lap;
  drive.apply(session_record(world));
  for (std::uint32_t i = 0; i < count; ++i) {
    drive.apply(keyframe_record(world, i));
    if (i < lap) continue;
    if (auto proposal = true_closure(drive.map(), world, i, i / lap * lap)) drive.apply(*proposal);
  }
}

TEST(MapBuilder, DerivedFactsStayInStepInAPlaceThatIsPassedManyTimes) {
  const sim::PointsWorld world(laps(320, 40));
  PointsDrive drive;
  drive_laps(drive, world, 320);
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
  std::size_t fixed = 0, max_observers = 0;
  for (std::uint32_t i = 0; i < 40; ++i)
    for (const storage::Landmark& landmark : drive.map().hot({kDriveSession, i})->landmarks) {
      fixed += storage::is_fixed(landmark.observers);
      max_observers = std::max(max_observers, landmark.observers.size());
    }
  EXPECT_GT(fixed, 500u);
  EXPECT_LE(max_observers, storage::kMaxObservers);
}

TEST(MapBuilder, FixedLandmarksAreReleasedExactlyWhenTheirClosuresAreRemoved) {
  const sim::PointsWorld world(laps(260, 40));
  PointsDrive drive;
  drive_laps(drive, world, 260);
  const auto first_from = [&](std::uint32_t frame) {
    for (;; ++frame)
      for (const storage::Edge& edge : drive.map().hot({kDriveSession, frame})->edges)
        if (accepted_loop(edge) && edge.carries) return edge.id;
  };
  // Of the second lap, whose observations are among the first of their landmarks; and of the last.
  const EdgeId second = first_from(45), last = first_from(245);
  for (const EdgeId id : {second, last}) {
    drive.apply(storage::SetEdgeStateRecord{id, storage::EdgeState::kRemoved, "test"});
    EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty()) << id.to_string();
  }
  drive.apply(storage::SetEdgeStateRecord{second, storage::EdgeState::kAccepted, "test"});
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
}

TEST(MapBuilder, ALoneClosureStaysACandidateAndBindsNothing) {
  const sim::PointsWorld world(laps(66, 60));
  PointsDrive with, without;
  with.drive(world, 66, [](std::uint32_t i) { return i == 64; });
  without.drive(world, 66, kNever);
  EXPECT_EQ(with.map().state().closures_candidate, 1u);
  EXPECT_EQ(with.map().hot({kDriveSession, 64})->edges.back().reason, Reason::LONE);
  for (std::uint32_t i = 1; i < 66; ++i) {
    const storage::Edge &mine = with.map().hot({kDriveSession, i})->edges.front(),
                        &other = without.map().hot({kDriveSession, i})->edges.front();
    EXPECT_EQ(mine.support, other.support) << "frame " << i;
    EXPECT_EQ(mine.T_ab.t, other.T_ab.t) << "frame " << i;
  }
  EXPECT_THAT(derived_differences(with.map()), testing::IsEmpty());
}

TEST(MapBuilder, AClosureThatTheRobotsMotionContradictsIsNotAccepted) {
  const sim::PointsWorld world(laps(72, 60));
  PointsDrive drive;
  drive.drive(world, 70, kNever);
  for (const std::uint32_t query : {66, 69}) {
    auto wrong = *true_closure(drive.map(), world, query, 60);
    wrong.match.index += 5;  // five frames on: a metre off
    drive.apply(wrong);
    const storage::Edge edge = drive.map().hot(wrong.query)->edges.back();
    EXPECT_EQ(edge.a, wrong.match);
    EXPECT_EQ(edge.state, storage::EdgeState::kCandidate);
    EXPECT_EQ(edge.reason, Reason::CONTRADICTS_MOTION);
  }
}

TEST(MapBuilder, LoopEdgesAreSpacedAndOtherClosuresOnlyBind) {
  const sim::PointsWorld world(laps(110, 60));
  PointsDrive drive;
  drive.drive(world, 110, kAlways);
  const std::size_t accepted = count_edges(drive.map(), 110, accepted_loop);
  const std::size_t carrying =
      count_edges(drive.map(), 110, [](const storage::Edge& e) { return accepted_loop(e) && e.carries; });
  EXPECT_GT(accepted, 40u);
  EXPECT_GE(carrying, 3u);
  EXPECT_LE(carrying, 10u);
}

TEST(MapBuilder, RemovingAClosureRestoresTheStructureOfARunWithoutIt) {
  const sim::PointsWorld world(laps(80, 60));
  PointsDrive drive;
  drive.drive(world, 80, kAlways);
  const auto first = drive.map().hot({kDriveSession, 62});
  ASSERT_TRUE(accepted_loop(first->edges.back()));
  drive.apply(storage::SetEdgeStateRecord{first->edges.back().id, storage::EdgeState::kRemoved, "test"});

  EXPECT_EQ(count_edges(drive.map(), 80, accepted_loop), 0u) << "all that agreed with it went with it";
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
  PointsDrive without;
  without.drive(world, 80, kNever);
  EXPECT_THAT(structural_differences(drive.map(), without.map(), kDriveSession), testing::IsEmpty());
}

TEST(MapBuilder, AfterRemovingAClosureTheSolutionIsThatOfARunWithoutIt) {
  const sim::PointsWorld world(laps(80, 60));
  PointsDrive drive, without;
  drive.drive(world, 80, kAlways);
  without.drive(world, 80, kNever);
  drive.apply(storage::SetEdgeStateRecord{drive.map().hot({kDriveSession, 62})->edges.back().id,
                                          storage::EdgeState::kRemoved, "test"});
  ASSERT_EQ(count_edges(drive.map(), 80, accepted_loop), 0u);

  rba::RbaOptions rba;
  for (PointsDrive* each : {&drive, &without})
    while (rba::Relaxer(each->map(), rba).relax_pending(rba.budget).work > 0) continue;
  EXPECT_LE(largest_difference(drive.map(), without.map(), kDriveSession).sigmas, 0.5) << "after idle work";

  for (PointsDrive* each : {&drive, &without}) rba::Relaxer(each->map(), rba).relax_fully();
  const Difference solved = largest_difference(drive.map(), without.map(), kDriveSession);
  EXPECT_LE(solved.metres, 1e-6);
  EXPECT_LE(solved.radians, 1e-6);
}

TEST(MapBuilder, ARemovedClosureCanBeRestored) {
  const sim::PointsWorld world(laps(75, 60));
  PointsDrive drive;
  drive.drive(world, 75, kAlways);
  const EdgeId id = drive.map().hot({kDriveSession, 64})->edges.back().id;
  const std::size_t accepted = count_edges(drive.map(), 75, accepted_loop);
  drive.apply(storage::SetEdgeStateRecord{id, storage::EdgeState::kRemoved, ""});
  ASSERT_EQ(count_edges(drive.map(), 75, accepted_loop), 0u);
  drive.apply(storage::SetEdgeStateRecord{id, storage::EdgeState::kAccepted, ""});
  EXPECT_EQ(count_edges(drive.map(), 75, accepted_loop), accepted);
  EXPECT_EQ(check_edge_edit(drive.map(), {id, storage::EdgeState::kAccepted, ""}).reason(), Reason::WRONG_STATE);
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
}

TEST(MapBuilder, OdometryEdgesAreNotRemoved) {
  const sim::PointsWorld world(laps(5, 60));
  PointsDrive drive;
  drive.drive(world, 5, kNever);
  const storage::SetEdgeStateRecord record{{{kDriveSession, 3}, 0}, storage::EdgeState::kRemoved, ""};
  EXPECT_EQ(check_edge_edit(drive.map(), record).reason(), Reason::ODOMETRY_EDGE);
  EXPECT_EQ(check_edge_edit(drive.map(), {{{kDriveSession, 3}, 7}, storage::EdgeState::kRemoved, ""}).reason(),
            Reason::NO_SUCH_EDGE);
  const storage::MapHash before = storage::hash_map(drive.map());
  drive.apply(record);
  EXPECT_EQ(storage::hash_map(drive.map()), before);
}

TEST(MapBuilder, AGapIsBridgedByAPriorEdge) {
  const sim::PointsWorld world(laps(20, 60));
  PointsDrive drive;
  drive.apply(session_record(world));
  for (std::uint32_t i = 0; i < 8; ++i) drive.apply(keyframe_record(world, i));
  drive.apply(storage::GapRecord{kDriveSession, 8, 11, Reason::DROPPED_BY_ROBOT});
  for (std::uint32_t i = 12; i < 20; ++i) drive.apply(keyframe_record(world, i));
  const auto hot = drive.map().hot({kDriveSession, 12});
  ASSERT_EQ(hot->edges.size(), 1u);
  EXPECT_EQ(hot->edges[0].kind, storage::EdgeKind::kPrior);
  EXPECT_EQ(hot->edges[0].reason, Reason::DECLARED_GAP);
  EXPECT_TRUE(hot->edges[0].prior_active);
  EXPECT_EQ(hot->edges[0].a, (FrameId{kDriveSession, 7}));
  EXPECT_EQ(drive.map().state().gaps, 4u);
  EXPECT_EQ(drive.map().session(kDriveSession)->next_sequence, 20u);
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
}

TEST(MapBuilder, ARefusedKeyframeIsSkippedAndCounted) {
  const sim::PointsWorld world(laps(6, 60));
  PointsDrive drive;
  drive.drive(world, 3, kNever);
  drive.apply(storage::RefusalRecord{kDriveSession, 3, 77, Reason::NOT_FINITE});
  drive.apply(keyframe_record(world, 3));  // too late
  EXPECT_FALSE(drive.map().hot({kDriveSession, 3}));
  drive.apply(keyframe_record(world, 4));
  EXPECT_TRUE(drive.map().hot({kDriveSession, 4}));
  EXPECT_EQ(drive.map().state().refused[static_cast<std::size_t>(Reason::NOT_FINITE)], 1u);
}

TEST(MapBuilder, TheSameJournalGivesTheSameMapWhereverItWasInterrupted) {
  const sim::PointsWorld world(laps(75, 60));
  PointsDrive whole;
  whole.drive(world, 75, kAlways);
  const EdgeId closure = whole.map().hot({kDriveSession, 66})->edges.back().id;
  const std::size_t before = whole.journal().size(), in_force = count_edges(whole.map(), 75, accepted_loop);
  whole.apply(edit_record(closure, EdgeAction::kRemoveAlone));
  ASSERT_EQ(count_edges(whole.map(), 75, accepted_loop), in_force - 1);
  whole.apply(edit_record(closure, EdgeAction::kRestore));
  whole.apply(edit_record(closure, EdgeAction::kRemoveAlone));
  const storage::MapHash expected = storage::hash_map(whole.map());

  for (const std::size_t cut :
       {std::size_t{1}, std::size_t{20}, std::size_t{63}, std::size_t{70}, before, before + 1, before + 2}) {
    const auto engine = storage::make_memory_engine();
    {
      PointsDrive first(engine);
      for (std::size_t n = 0; n < cut; ++n) first.apply(whole.journal()[n]);
      ASSERT_TRUE(first.map().commit().ok());
      if (cut + 1 < whole.journal().size()) first.apply(whole.journal()[cut]);  // never committed
    }
    PointsDrive second(engine);
    ASSERT_EQ(second.map().state().applied_sequence, cut);
    for (std::size_t n = cut; n < whole.journal().size(); ++n) second.apply(whole.journal()[n]);
    EXPECT_EQ(storage::hash_map(second.map()), expected) << "cut after " << cut;
  }
}

// Thawing a session does not mean that its robot goes on.
TEST(MapBuilder, AThawedSessionIsWhatItWasBeforeItWasFrozen) {
  const sim::PointsWorld world(laps(6, 60));
  const auto engine = storage::make_memory_engine();
  const auto set = [](PointsDrive& drive, storage::SessionState state) {
    drive.apply(storage::SetSessionStateRecord{kDriveSession, state});
    return drive.map().session(kDriveSession)->state;
  };
  {
    PointsDrive drive(engine);
    drive.drive(world, 3, kNever);
    EXPECT_EQ(set(drive, storage::SessionState::kFrozen), storage::SessionState::kFrozen);
    EXPECT_EQ(set(drive, storage::SessionState::kOpen), storage::SessionState::kOpen);
    EXPECT_EQ(set(drive, storage::SessionState::kEnded), storage::SessionState::kEnded);
    EXPECT_EQ(set(drive, storage::SessionState::kFrozen), storage::SessionState::kFrozen);
    EXPECT_EQ(set(drive, storage::SessionState::kEnded), storage::SessionState::kFrozen)
        << "the robot's end does not thaw it";
    EXPECT_EQ(set(drive, storage::SessionState::kOpen), storage::SessionState::kEnded);
    EXPECT_EQ(set(drive, storage::SessionState::kFrozen), storage::SessionState::kFrozen);
    ASSERT_TRUE(drive.map().commit().ok());
  }
  PointsDrive drive(engine);  // a daemon that is started again
  EXPECT_EQ(set(drive, storage::SessionState::kOpen), storage::SessionState::kEnded);
  drive.apply(keyframe_record(world, 3));
  EXPECT_EQ(drive.map().session(kDriveSession)->state, storage::SessionState::kOpen) << "a keyframe opens it again";
  EXPECT_EQ(set(drive, storage::SessionState::kEnded), storage::SessionState::kEnded);
  EXPECT_EQ(set(drive, storage::SessionState::kFrozen), storage::SessionState::kFrozen);
  drive.apply(keyframe_record(world, 4));  // it was on its way when the session was frozen
  EXPECT_EQ(drive.map().session(kDriveSession)->state, storage::SessionState::kFrozen);
  EXPECT_EQ(set(drive, storage::SessionState::kOpen), storage::SessionState::kOpen);
  EXPECT_EQ(set(drive, storage::SessionState::kFrozen), storage::SessionState::kFrozen);
  EXPECT_EQ(set(drive, storage::SessionState::kDeleting), storage::SessionState::kDeleting);
  EXPECT_EQ(set(drive, storage::SessionState::kOpen), storage::SessionState::kDeleting) << "deletion is for good";
}

}  // namespace
}  // namespace relmap::map
