#include "server/map/deletion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <set>

#include "proto/geometry/covariance.h"
#include "server/map/derived.h"
#include "server/map/edge_edit.h"
#include "server/map/testing/points_drive.h"
#include "server/route/transform.h"
#include "storage/graph/binding.h"
#include "storage/graph/observers.h"
#include "storage/maintenance/verify.h"
#include "storage/testing/event_follower.h"

namespace relmap::map {
namespace {

constexpr SessionNumber kRobots = 3;

// Robots drive round the same circuit, a lap each: robot r is session r. What one sees again is told by closures.
class Robots : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kLap = 136;  // keyframes: two chunks and a part of a third

  explicit Robots(SessionNumber robots) : world_(circuit(robots)) {}

  static sim::PointsWorldOptions circuit(SessionNumber robots) {
    sim::PointsWorldOptions options;
    options.frames = robots * kLap;
    options.frames_per_lap = kLap;
    options.births = 18;
    options.pixel_noise = 0.5;
    return options;
  }

  storage::Map& map() { return drive_->map(); }
  std::uint32_t in_world(FrameId frame) const { return (frame.session - 1) * kLap + frame.index; }
  SE3 truth(FrameId a, FrameId b) const {
    return world_.T_world_frame(in_world(a)).inverse() * world_.T_world_frame(in_world(b));
  }

  SessionHeader header(SessionNumber robot) const {
    SessionHeader header = world_.keyframe(0).session;
    header.uuid.bytes[0] = static_cast<std::uint8_t>(robot);
    header.robot = header.name = "robot " + std::to_string(robot);
    return header;
  }
  storage::SessionRecord begin(SessionNumber robot) const { return {robot, header(robot).name, header(robot)}; }

  void take_in(SessionNumber robot, std::uint32_t i) {
    const std::uint32_t start = (robot - 1) * kLap;
    Keyframe keyframe = world_.keyframe(start + i);
    keyframe.session = header(robot);
    keyframe.sequence = i;
    if (i == 0) keyframe.source = MotionSource::kStart;
    for (TrackMeasurement& z : keyframe.tracks) {
      if (z.track.sequence >= start)
        z.track.sequence -= start;
      else
        z.track = {0, 100'000 + (start - z.track.sequence) * 1000 + z.track.index};  // it saw it first in frame 0
    }
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    drive_->apply(storage::KeyframeRecord{robot, crc, std::move(payload)});
  }

  // What frame `i` of a robot sees again of what another saw there: by its tracks, and some of what it does
  // not track in its picture.
  std::vector<storage::ProposedBinding> seen_again(SessionNumber robot, std::uint32_t i, SessionNumber before) {
    std::map<sim::PointId, LandmarkId> known;
    for (std::uint32_t k = i < 4 ? 0 : i - 4; k <= i + 4; ++k) {
      const auto warm = map().warm({before, k});
      if (!warm) continue;
      const auto points = world_.landmarks((before - 1) * kLap + k);
      for (std::size_t n = 0; n < points.size(); ++n)
        if (const LandmarkId landmark = storage::resolve(map(), warm->observations[n].landmark); landmark.valid())
          known.try_emplace(points[n], landmark);
    }
    std::vector<storage::ProposedBinding> bindings;
    const std::uint32_t own = (robot - 1) * kLap + i;
    const auto points = world_.landmarks(own);
    for (std::size_t n = 0; n < points.size(); ++n)
      if (const auto found = known.extract(points[n]))
        bindings.push_back({found.mapped(), static_cast<std::int32_t>(n)});
    const StereoCamera camera = world_.options().camera;
    for (const auto& [point, landmark] : known) {
      const Vector3 p = world_.T_world_frame(own).inverse() * world_.point(point);
      const double u = camera.f * p.x() / p.z() + camera.cx, v = camera.f * p.y() / p.z() + camera.cy;
      const double right = u - camera.f * camera.baseline / p.z();
      if (p.z() < 1 || right < 0 || u >= camera.width || v < 0 || v >= camera.height) continue;
      bindings.push_back({landmark, -1, static_cast<float>(u), static_cast<float>(v), static_cast<float>(right)});
    }
    return bindings;
  }
  void close(SessionNumber robot, std::uint32_t i, SessionNumber before) {
    const FrameId query{robot, i}, match{before, i};
    if (!map().hot(match)) return;
    storage::ClosureProposalRecord proposal;
    proposal.query = query;
    proposal.match = match;
    if (map().hot(match)->journal_sequence > map().hot(query)->journal_sequence)
      std::swap(proposal.query, proposal.match);
    proposal.T_match_query = truth(proposal.match, proposal.query);
    proposal.covariance = Matrix6::Identity() * 1e-4;
    proposal.probability = 0.99f;
    proposal.spread = 0.5f;
    proposal.bindings = seen_again(robot, i, before);
    proposal.inliers = static_cast<std::uint16_t>(proposal.bindings.size());
    drive_->apply(proposal);
  }
  void bind(SessionNumber robot, std::uint32_t i) {
    for (const storage::Edge& edge : map().hot({robot, i - 2})->edges)
      if (edge.kind == storage::EdgeKind::kLoop && edge.state == storage::EdgeState::kAccepted) {
        drive_->apply(storage::BindingRecord{{robot, i}, edge.id, seen_again(robot, i, edge.a.session)});
        return;
      }
  }

  // Every reference of what is left leads somewhere, and everything derived follows from it.
  void expect_whole(const std::string& when) {
    SCOPED_TRACE(when);
    EXPECT_THAT(derived_differences(map()), testing::IsEmpty());
    ASSERT_TRUE(map().commit().ok());
    follower_.follow(*engine_->snapshot());
    EXPECT_EQ(follower_.map(), storage::ToldMap::of(map())) << "what the log of events tells";
    std::vector<std::string> findings;
    const auto found = [&](const storage::Finding& finding) {
      findings.push_back(finding.frame.to_string() + " " + finding.what);
    };
    ASSERT_TRUE(storage::verify(*engine_->snapshot(), {}, found, {}).ok());
    EXPECT_THAT(findings, testing::IsEmpty());
  }
  void remove(SessionNumber session, const std::function<void()>& after_each = {}) {
    drive_->apply(storage::SetSessionStateRecord{session, storage::SessionState::kDeleting});
    while (const auto next = next_deletion(*map().session(session))) {
      drive_->apply(*next);
      if (after_each) after_each();
    }
  }
  std::size_t observations(SessionNumber session) {
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < kLap; ++i) {
      const auto warm = map().warm({session, i});
      count += storage::landmarks_seen(map(), *warm).size();
    }
    return count;
  }
  std::vector<storage::Edge> edges(const std::function<bool(const storage::Edge&)>& wanted) {
    std::vector<storage::Edge> found;
    for (const storage::Session& session : map().sessions())
      for (std::uint32_t i = 0; session.frames > 0 && i <= session.last; ++i)
        std::ranges::copy_if(map().hot({session.number, i})->edges, std::back_inserter(found), wanted);
    return found;
  }
  std::vector<storage::Edge> bridges() {
    return edges([](const storage::Edge& edge) { return edge.verification == storage::Verification::kCompounded; });
  }
  // Of the way between frames of two sessions from the truth, in metres.
  double worst_error(SessionNumber a, SessionNumber b) {
    double worst = 0;
    for (std::uint32_t i = 5; i < kLap; i += 10) {
      const FrameId from{a, i}, to{b, i};
      const auto way = route::transform_between(map(), from, to);
      EXPECT_TRUE(way.ok()) << way.status().to_string();
      if (way.ok()) worst = std::max(worst, (way->T_ab.inverse() * truth(from, to)).t.norm());
    }
    return worst;
  }

  const sim::PointsWorld world_;
  std::shared_ptr<storage::Engine> engine_ = storage::make_memory_engine();
  std::unique_ptr<PointsDrive> drive_ = std::make_unique<PointsDrive>(engine_);
  storage::EventFollower follower_;
};

// Three robots, each with closures to the one before it alone.
class ThreeRobots : public Robots {
 protected:
  ThreeRobots() : Robots(kRobots) {}

  void drive(bool side_by_side) {
    for (SessionNumber robot = 1; robot <= kRobots; ++robot) drive_->apply(begin(robot));
    const auto frame = [&](SessionNumber robot, std::uint32_t i) {
      take_in(robot, i);
      if (robot > 1 && i % 4 == 0) close(robot, i, robot - 1);
      if (robot > 1 && i % 4 == 2 && i > 20) bind(robot, i);
    };
    if (side_by_side) {  // one a little ahead of the next
      for (std::uint32_t i = 0; i < kLap + 2 * kBehind; ++i)
        for (SessionNumber robot = 1; robot <= kRobots; ++robot)
          if (const std::uint32_t behind = (robot - 1) * kBehind; i >= behind && i < kLap + behind)
            frame(robot, i - behind);
    } else {
      for (SessionNumber robot = 1; robot <= kRobots; ++robot)
        for (std::uint32_t i = 0; i < kLap; ++i) frame(robot, i);
    }
    drive_->apply(storage::IdleWorkRecord{500'000});
    ASSERT_THAT(derived_differences(map()), testing::IsEmpty());
  }

  static constexpr std::uint32_t kBehind = 40;
};

class Deleting : public ThreeRobots, public ::testing::WithParamInterface<bool> {
 protected:
  void SetUp() override { drive(GetParam()); }
};

TEST_P(Deleting, DeletingTheOldestKeepsWhatTheOthersKnow) {
  const double before = worst_error(2, 3);
  const std::size_t seen = observations(2);
  remove(1, [&] { expect_whole("after a chunk"); });
  EXPECT_TRUE(storage::is_deleted(*map().session(1)));
  EXPECT_FALSE(map().hot({1, 0}) || map().warm({1, 0}) || map().cold({1, 0}));
  EXPECT_LT(worst_error(2, 3), before + 0.02);
  // Several of the robot's tracks of one point in different passes are one landmark no more; nothing else goes.
  EXPECT_GT(observations(2), seen * 95 / 100);
  EXPECT_THAT(bridges(), testing::IsEmpty()) << "each of the others hangs together by itself";
}

TEST_P(Deleting, DeletingTheMiddleOneLeavesABridge) {
  const double before = worst_error(1, 3);
  const std::size_t loops =
      edges([](const storage::Edge& edge) { return edge.kind == storage::EdgeKind::kLoop && edge.in_graph(); }).size();
  for (const SessionNumber labelled : {2u, 3u}) drive_->apply(storage::SetLabelRecord{{labelled, 5}, "dock", true});
  remove(2, [&] { expect_whole("after a chunk"); });
  EXPECT_THAT(map().labelled("dock"), testing::ElementsAre(FrameId{3, 5}));
  EXPECT_LT(worst_error(1, 3), before + 0.05);
  const std::vector<storage::Edge> made = bridges();
  EXPECT_GE(made.size(), kLap / 40);
  EXPECT_LT(made.size(), loops) << "one for two that led over the session, at most";
  for (const storage::Edge& edge : made) {
    EXPECT_TRUE(edge.in_graph());
    EXPECT_TRUE(edge.prior_active);
    EXPECT_EQ(edge.reason, Reason::SESSION_DELETED);
    EXPECT_LT(map().hot(edge.a)->journal_sequence, map().hot(edge.b)->journal_sequence);
    const Vector6 error = (edge.T_ab.inverse() * truth(edge.a, edge.b)).log();
    EXPECT_LT(mahalanobis_squared(error, edge.covariance), 40) << edge.id.to_string();
    EXPECT_LT(edge.covariance.trace(), 0.1);
  }
}

TEST_P(Deleting, DeletingTheNewestLeavesNoTrace) {
  const double before = worst_error(1, 2);
  const std::size_t seen = observations(1);
  remove(3, [&] { expect_whole("after a chunk"); });
  EXPECT_EQ(observations(1), seen);
  EXPECT_LT(worst_error(1, 2), before + 0.02);
  EXPECT_THAT(bridges(), testing::IsEmpty());
  EXPECT_EQ(map().sessions().size(), kRobots) << "its uuid is not taken again";
}

TEST_P(Deleting, TheMapIsConsistentAfterEachOfSeveralDeletions) {
  remove(2);
  drive_->apply(storage::IdleWorkRecord{500'000});
  expect_whole("the second is gone");
  // A bridge can be taken out as any closure.
  const std::vector<storage::Edge> made = bridges();
  ASSERT_FALSE(made.empty());
  drive_->apply(storage::SetEdgeStateRecord{made.front().id, storage::EdgeState::kRemoved, "not there"});
  expect_whole("a bridge is out");
  drive_->apply(storage::SetEdgeStateRecord{made.front().id, storage::EdgeState::kAccepted, ""});
  expect_whole("and back");
  remove(1);
  expect_whole("the first is gone");
  remove(3);
  expect_whole("all are gone");
  EXPECT_EQ(map().state().closures_accepted + map().state().closures_candidate + map().state().closures_removed, 0u);
  EXPECT_TRUE(map().state().pending.empty());
}

TEST_F(ThreeRobots, DeletionIsAFunctionOfTheJournalWhereverItIsInterrupted) {
  drive(true);
  remove(2);
  const storage::MapHash whole = storage::hash_map(map());
  ASSERT_TRUE(map().commit().ok());
  EXPECT_EQ(storage::hash_map(*storage::Map::open(engine_, engine_->acquire().or_throw(),
                                                  std::make_shared<storage::Budget>(256u << 20))
                                   .or_throw()),
            whole);
  const std::vector<storage::JournalRecord> journal = drive_->journal();
  const std::size_t first_deletion =
      static_cast<std::size_t>(std::find_if(journal.begin(), journal.end(),
                                            [](const storage::JournalRecord& r) {
                                              return std::holds_alternative<storage::RemoveChunkRecord>(r);
                                            }) -
                               journal.begin());
  // Committed and opened again before each record of the deletion.
  const auto engine = storage::make_memory_engine();
  auto again = std::make_unique<PointsDrive>(engine);
  for (std::size_t r = 0; r < journal.size(); ++r) {
    if (r + 1 >= first_deletion) {
      ASSERT_TRUE(again->map().commit().ok());
      again.reset();
      again = std::make_unique<PointsDrive>(engine);
    }
    again->apply(journal[r]);
  }
  EXPECT_EQ(storage::hash_map(again->map()), whole);
}

TEST_F(ThreeRobots, RecordsForASessionBeingDeletedChangeNothing) {
  drive(false);
  drive_->apply(storage::SetSessionStateRecord{2, storage::SessionState::kDeleting});
  // Keyframes and gaps on their way are passed over, and leave no record: what is left of the session must not grow.
  take_in(2, kLap);
  drive_->apply(storage::GapRecord{2, kLap + 1, kLap + 3});
  const storage::Session session = *map().session(2);
  EXPECT_EQ(session.frames, kLap);
  EXPECT_EQ(session.next_sequence, kLap + 4);
  EXPECT_EQ(session.refused, 0u);
  EXPECT_EQ(session.given_up, 0u);
  EXPECT_EQ(map().state().gaps, 0u);
  EXPECT_EQ(map().state().refused[static_cast<std::size_t>(Reason::SESSION_DELETED)], 1u);
  const storage::MapHash before = storage::hash_map(map());
  close(3, 0, 2);
  drive_->apply(storage::SetSessionStateRecord{2, storage::SessionState::kFrozen});
  drive_->apply(storage::SetLabelRecord{{2, 5}, "hall", true});
  drive_->apply(storage::RemoveChunkRecord{2, 0});  // not its last
  drive_->apply(storage::RemoveChunkRecord{1, 2});  // nobody deletes it
  EXPECT_EQ(storage::hash_map(map()), before);
  EXPECT_EQ(map().session(2)->state, storage::SessionState::kDeleting);
  const auto carrying = map().hot({3, 4})->edges.back().id;
  EXPECT_EQ(check_edge_edit(map(), {carrying, storage::EdgeState::kRemoved, ""}).reason(), Reason::SESSION_DELETED);
  remove(2, [&] { expect_whole("after a chunk"); });
}

INSTANTIATE_TEST_SUITE_P(Drives, Deleting, ::testing::Bool(),
                         [](const auto& drive) { return drive.param ? "SideBySide" : "OneAfterAnother"; });

// Nothing but the newest of three joins two older ones, and a fourth knows the second only.
class DeletingTheLink : public Robots {
 protected:
  DeletingTheLink() : Robots(4) {}
};

TEST_F(DeletingTheLink, BridgesLeadBetweenOlderFrames) {
  for (SessionNumber robot = 1; robot <= 4; ++robot) {
    drive_->apply(begin(robot));
    for (std::uint32_t i = 0; i < kLap; ++i) {
      take_in(robot, i);
      if (robot == 3 && i % 8 == 0) close(3, i, 1);
      if (robot == 3 && i % 8 == 4) close(3, i, 2);
      if (robot == 4 && i % 4 == 2) close(4, i, 2);
    }
  }
  drive_->apply(storage::IdleWorkRecord{500'000});
  ASSERT_THAT(derived_differences(map()), testing::IsEmpty());
  const double before = worst_error(1, 2);
  remove(3, [&] { expect_whole("after a chunk"); });
  EXPECT_LT(worst_error(1, 2), before + 0.1);
  EXPECT_LT(worst_error(1, 4), before + 0.1);
  for (const storage::Edge& edge : bridges()) {
    EXPECT_EQ(edge.a.session, 1u);
    EXPECT_NE(edge.b.session, 3u);
  }
}

// A place that has been passed so often that its landmarks are fixed.
class DeletingInABusyPlace : public Robots, public ::testing::WithParamInterface<SessionNumber> {
 protected:
  static constexpr SessionNumber kPasses = 6;
  DeletingInABusyPlace() : Robots(kPasses) {}
};

TEST_P(DeletingInABusyPlace, FixedLandmarksAreSeenByOthers) {
  constexpr std::uint32_t kStretch = 80;
  for (SessionNumber robot = 1; robot <= kPasses; ++robot) {
    drive_->apply(begin(robot));
    for (std::uint32_t i = 0; i < kStretch; ++i) {
      take_in(robot, i);
      if (robot > 1 && i % 4 == 0) close(robot, i, robot % 2 == 0 ? 1 : robot - 1);
      if (robot > 1 && i % 4 == 2 && i > 20) bind(robot, i);
    }
  }
  ASSERT_THAT(derived_differences(map()), testing::IsEmpty());
  remove(GetParam(), [&] { expect_whole("after a chunk"); });
  for (SessionNumber robot = 1; robot <= kPasses; ++robot)
    if (robot != GetParam()) {
      EXPECT_TRUE(route::transform_between(map(), {robot, 40}, {GetParam() == 1 ? 2u : 1u, 40}).ok()) << robot;
    }
}

INSTANTIATE_TEST_SUITE_P(Passes, DeletingInABusyPlace, ::testing::Values(1u, 5u));

}  // namespace
}  // namespace relmap::map
