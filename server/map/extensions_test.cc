// What a later version says passes through this one: from the records of the journal into the map, through relaxation,
// edits, commits and starts.
#include <gtest/gtest.h>

#include "server/map/testing/points_drive.h"
#include "storage/format/state_codec.h"

namespace relmap::map {
namespace {

Extensions told(std::uint8_t what) { return {{1000, {what}}, {2000, {1, 2, 3}}}; }

// Each record as it stands in the journal.
storage::JournalRecord written(const storage::JournalRecord& record) {
  return storage::decode_record(storage::encode_record(record, 0)).or_throw().record;
}

class LaterExtensions : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 90, kLap = 40;

  LaterExtensions() {
    sim::PointsWorldOptions options;
    options.frames = kFrames;
    options.frames_per_lap = kLap;
    const sim::PointsWorld world(options);
    PointsDrive drive(engine_);
    storage::SessionRecord session = session_record(world);
    session.header.unknown = told(1);
    drive.apply(written(session));
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      Keyframe keyframe = world.keyframe(i);
      keyframe.session.unknown = told(2);  // of a front-end that was brought up to date in between
      keyframe.unknown = told(static_cast<std::uint8_t>(i));
      Bytes payload = encode_keyframe(keyframe);
      const std::uint32_t crc = crc32c(payload);
      drive.apply(written(storage::KeyframeRecord{kDriveSession, crc, std::move(payload)}));
      if (auto proposal = true_closure(drive.map(), world, i, kLap)) {
        proposal->unknown = told(static_cast<std::uint8_t>(100 + i));
        proposal->uniqueness.known = true;
        proposal->uniqueness.runner_up = {kDriveSession, i / 2};
        proposal->uniqueness.alike = 3;
        drive.apply(written(*proposal));
      }
      EXPECT_TRUE(i % 20 != 19 || drive.map().commit().ok());
    }
    drive.map().state().unknown = told(200);
    drive.map().edit_session(kDriveSession).unknown = told(201);
    EXPECT_TRUE(drive.map().commit().ok());
    expect_all(drive.map());
  }

  static void expect_all(const storage::Graph& graph) {
    EXPECT_EQ(graph.session(kDriveSession)->header.unknown, told(1));
    EXPECT_EQ(graph.session(kDriveSession)->unknown, told(201));
    std::size_t closures = 0;
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      const auto hot = graph.hot({kDriveSession, i});
      EXPECT_EQ(hot->unknown, told(static_cast<std::uint8_t>(i)));
      for (const storage::Edge& edge : hot->edges) {
        if (edge.kind != storage::EdgeKind::kLoop) continue;
        ++closures;
        EXPECT_EQ(edge.unknown, told(static_cast<std::uint8_t>(100 + i)));
        EXPECT_TRUE(edge.uniqueness.known);
        EXPECT_EQ(edge.uniqueness.runner_up, (FrameId{kDriveSession, i / 2}));
        EXPECT_EQ(edge.uniqueness.alike, 3U);
      }
    }
    EXPECT_GT(closures, 30U);
  }

  const std::shared_ptr<storage::Engine> engine_ = storage::make_memory_engine();
};

TEST_F(LaterExtensions, SurviveRelaxationEditsCommitsAndRestarts) {
  {
    PointsDrive drive(engine_);
    expect_all(drive.map());
    const FrameId frame{kDriveSession, 60};
    const EdgeId closure = drive.map().hot(frame)->edges.back().id;
    const SE3 before = drive.map().hot(frame)->edges.front().T_ab;
    for (const storage::EdgeState state :
         {storage::EdgeState::kRemoved, storage::EdgeState::kAccepted, storage::EdgeState::kRemoved})
      drive.apply(written(storage::SetEdgeStateRecord{closure, state, "", false, false, 0, told(5)}));
    drive.apply(written(storage::SetLabelRecord{frame, "dock", true, told(6)}));
    drive.apply(written(storage::IdleWorkRecord{1000000}));
    drive.apply(written(storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kFrozen, told(7)}));
    EXPECT_NE(drive.map().hot(frame)->edges.front().T_ab.t, before.t);
    EXPECT_EQ(drive.map().hot(frame)->edges.back().state, storage::EdgeState::kRemoved);
    expect_all(drive.map());
    ASSERT_TRUE(drive.map().commit().ok());
  }
  PointsDrive drive(engine_);
  expect_all(drive.map());
  EXPECT_EQ(drive.map().state().unknown, told(200));
  EXPECT_EQ(drive.map().session(kDriveSession)->state, storage::SessionState::kFrozen);
}

TEST_F(LaterExtensions, AreHashedUnlessTheyOnlyTellHowTheMapCameAbout) {
  PointsDrive drive(engine_);
  storage::Map& map = drive.map();
  const storage::MapHash hash = storage::hash_map(map);
  storage::FrameHot& frame = map.edit_hot({kDriveSession, 60});
  for (const std::uint32_t tag : {16U, 17U, 18U, 19U, 20U}) {  // identity, epoch, owner, wall time, author
    const Extensions kept = frame.unknown;
    frame.unknown.insert(frame.unknown.begin(), {tag, {1, 2}});
    frame.edges[0].unknown.insert(frame.edges[0].unknown.begin(), {tag, {1, 2}});
    map.edit_session(kDriveSession)
        .header.unknown.insert(map.edit_session(kDriveSession).header.unknown.begin(), {tag, {3}});
    EXPECT_EQ(storage::hash_map(map), hash) << tag;
    frame.unknown = kept;
    frame.edges[0].unknown.clear();
    map.edit_session(kDriveSession).header.unknown = told(1);
  }
  map.state().unknown = {};
  frame.journal_sequence += 1;
  EXPECT_EQ(storage::hash_map(map), hash);
  frame.edges[0].unknown = {{1000, {}}};
  const storage::MapHash other = storage::hash_map(map);
  EXPECT_NE(other, hash);
  frame.edges[0].unknown.clear();
  frame.edges[0].carried_by = {{{kDriveSession, 50}, 1}};
  EXPECT_NE(storage::hash_map(map), hash);
  frame.edges[0].carried_by.clear();
  EXPECT_EQ(storage::hash_map(map), hash);
}

}  // namespace
}  // namespace relmap::map
