// What a later version says passes through this one: from the records of the journal into the map, through relaxation,
// edits, commits and starts.
#include <gtest/gtest.h>

#include "server/map/testing/points_drive.h"
#include "storage/state_codec.h"

namespace relmap {
namespace {

constexpr std::uint32_t kFrames = 90, kLap = 40;

Extensions told(std::uint8_t what) { return {{1000, {what}}, {2000, {1, 2, 3}}}; }

// Each record as it stands in the journal.
JournalRecord written(const JournalRecord& record) { return decode_record(encode_record(record, 0)).or_throw().record; }

class LaterExtensions : public ::testing::Test {
 protected:
  LaterExtensions() {
    sim::PointsWorldOptions options;
    options.frames = kFrames;
    options.frames_per_lap = kLap;
    const sim::PointsWorld world(options);
    PointsDrive drive(engine_);
    SessionRecord session = session_record(world);
    session.header.unknown = told(1);
    drive.apply(written(session));
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      Keyframe keyframe = world.keyframe(i);
      keyframe.session.unknown = told(2);  // of a front-end that was brought up to date in between
      keyframe.unknown = told(static_cast<std::uint8_t>(i));
      Bytes payload = encode_keyframe(keyframe);
      const std::uint32_t crc = crc32c(payload);
      drive.apply(written(KeyframeRecord{kDriveSession, crc, std::move(payload)}));
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

  static void expect_all(const Graph& graph) {
    EXPECT_EQ(graph.session(kDriveSession)->header.unknown, told(1));
    EXPECT_EQ(graph.session(kDriveSession)->unknown, told(201));
    std::size_t closures = 0;
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      const auto hot = graph.hot({kDriveSession, i});
      EXPECT_EQ(hot->unknown, told(static_cast<std::uint8_t>(i)));
      for (const Edge& edge : hot->edges) {
        if (edge.kind != EdgeKind::kLoop) continue;
        ++closures;
        EXPECT_EQ(edge.unknown, told(static_cast<std::uint8_t>(100 + i)));
        EXPECT_TRUE(edge.uniqueness.known);
        EXPECT_EQ(edge.uniqueness.runner_up, (FrameId{kDriveSession, i / 2}));
        EXPECT_EQ(edge.uniqueness.alike, 3U);
      }
    }
    EXPECT_GT(closures, 30U);
  }

  const std::shared_ptr<Engine> engine_ = make_memory_engine();
};

TEST_F(LaterExtensions, StayThroughRelaxationEditsCommitsAndStarts) {
  {
    PointsDrive drive(engine_);
    expect_all(drive.map());
    const FrameId frame{kDriveSession, 60};
    const EdgeId closure = drive.map().hot(frame)->edges.back().id;
    const SE3 before = drive.map().hot(frame)->edges.front().T_ab;
    for (const EdgeState state : {EdgeState::kRemoved, EdgeState::kAccepted, EdgeState::kRemoved})
      drive.apply(written(SetEdgeStateRecord{closure, state, "", false, false, 0, told(5)}));
    drive.apply(written(SetLabelRecord{frame, "dock", true, told(6)}));
    drive.apply(written(IdleWorkRecord{1000000}));
    drive.apply(written(SetSessionStateRecord{kDriveSession, SessionState::kFrozen, told(7)}));
    EXPECT_NE(drive.map().hot(frame)->edges.front().T_ab.t, before.t);
    EXPECT_EQ(drive.map().hot(frame)->edges.back().state, EdgeState::kRemoved);
    expect_all(drive.map());
    ASSERT_TRUE(drive.map().commit().ok());
  }
  PointsDrive drive(engine_);
  expect_all(drive.map());
  EXPECT_EQ(drive.map().state().unknown, told(200));
  EXPECT_EQ(drive.map().session(kDriveSession)->state, SessionState::kFrozen);
}

TEST_F(LaterExtensions, CountForTheHashButWhatOnlyTellsHowTheMapCameAbout) {
  PointsDrive drive(engine_);
  Map& map = drive.map();
  const MapHash hash = hash_map(map);
  FrameHot& frame = map.edit_hot({kDriveSession, 60});
  for (const std::uint32_t tag : {16U, 17U, 18U, 19U, 20U}) {  // identity, epoch, owner, wall time, author
    const Extensions kept = frame.unknown;
    frame.unknown.insert(frame.unknown.begin(), {tag, {1, 2}});
    frame.edges[0].unknown.insert(frame.edges[0].unknown.begin(), {tag, {1, 2}});
    map.edit_session(kDriveSession)
        .header.unknown.insert(map.edit_session(kDriveSession).header.unknown.begin(), {tag, {3}});
    EXPECT_EQ(hash_map(map), hash) << tag;
    frame.unknown = kept;
    frame.edges[0].unknown.clear();
    map.edit_session(kDriveSession).header.unknown = told(1);
  }
  map.state().unknown = {};
  frame.journal_sequence += 1;
  EXPECT_EQ(hash_map(map), hash);
  frame.edges[0].unknown = {{1000, {}}};
  const MapHash other = hash_map(map);
  EXPECT_NE(other, hash);
  frame.edges[0].unknown.clear();
  frame.edges[0].carried_by = {{{kDriveSession, 50}, 1}};
  EXPECT_NE(hash_map(map), hash);
  frame.edges[0].carried_by.clear();
  EXPECT_EQ(hash_map(map), hash);
}

}  // namespace
}  // namespace relmap
