#include "server/map/graph_piece.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <memory>
#include <utility>

#include "server/place/testing/hand_made_graph.h"
#include "storage/engine/memory_engine.h"

namespace relmap::map {
namespace {

constexpr std::uint32_t kKnown = 10;  // frames of the session that the map holds

SessionHeader imported_header() {
  SessionHeader header;
  header.uuid.bytes[0] = 7;
  header.robot = "imported";
  header.name = "circuit";
  header.camera = kNoCamera;
  return header;
}

Keyframe imported_frame(std::int64_t time_us) {
  Keyframe keyframe;
  keyframe.time_us = time_us;
  return keyframe;
}

storage::ClosureProposalRecord loop_between(std::uint32_t query, std::uint32_t match) {
  storage::ClosureProposalRecord loop;
  loop.query.index = query;
  loop.match.index = match;
  return loop;
}

class GraphPieceTest : public ::testing::Test {
 protected:
  // Frame i at i + 1 seconds.
  static GraphPiece piece(std::uint32_t first, std::uint32_t end) {
    GraphPiece piece = GraphPiece::make(imported_header(), first, end - first).or_throw();
    for (std::uint32_t i = first; i < end; ++i) {
      const Status added = piece.add_frame(imported_frame(1'000'000 * (i + 1)));
      EXPECT_TRUE(added.ok()) << added.to_string();
    }
    return piece;
  }
  // A map that holds frames 0 .. kKnown - 1 of the session.
  static place::HandMadeGraph map_of_session() {
    place::HandMadeGraph map;
    map.add_session(1, kNoCamera);
    for (std::uint32_t i = 0; i < kKnown; ++i) map.add_frame({1, i});
    storage::Session& session = map.edit_session(1);
    session.header = imported_header();
    session.next_sequence = kKnown;
    session.last_time_us = 1'000'000 * kKnown;
    return map;
  }
};

TEST_F(GraphPieceTest, FramesThatTheMapHoldsAreDropped) {
  const auto map = map_of_session();
  GraphPiece overlapping = piece(5, 15);
  EXPECT_TRUE(overlapping.fit(map).ok());
  ASSERT_EQ(overlapping.frames().size(), 5u);
  EXPECT_EQ(overlapping.frames().front().sequence, kKnown);
  GraphPiece repeated = piece(0, kKnown);
  EXPECT_TRUE(repeated.fit(map).ok());
  EXPECT_TRUE(repeated.frames().empty());
}

TEST_F(GraphPieceTest, APieceMustContinueTheSession) {
  EXPECT_EQ(piece(5, 10).fit(place::HandMadeGraph()).to_string(), "NO_SUCH_FRAME: frames from 0 on are missing");
  EXPECT_EQ(piece(12, 15).fit(map_of_session()).to_string(), "NO_SUCH_FRAME: frames from 10 on are missing");
  EXPECT_TRUE(piece(10, 15).fit(map_of_session()).ok());
}

TEST_F(GraphPieceTest, FramesMustFollowEachOtherInTime) {
  GraphPiece within = piece(0, 3);
  EXPECT_EQ(within.add_frame(imported_frame(3'000'000)).to_string(),
            "BAD_DURATION: frame 3 is no later than the one before");
  GraphPiece early = GraphPiece::make(imported_header(), kKnown, 1).or_throw();
  ASSERT_TRUE(early.add_frame(imported_frame(1'000'000 * kKnown)).ok());
  EXPECT_EQ(early.fit(map_of_session()).to_string(),
            "TIME_BACKWARDS: frame 10 is no later than the last one of the map");
}

TEST_F(GraphPieceTest, AnInvalidFrameIsRefusedByName) {
  GraphPiece good = piece(0, 3);
  Keyframe frame = imported_frame(4'000'000);
  frame.source = MotionSource::kVision;
  frame.step_covariance = -Matrix6::Identity();
  const Status status = good.add_frame(frame);
  EXPECT_EQ(status.to_string().substr(0, 24), "BAD_COVARIANCE: frame 3:");
  EXPECT_EQ(good.frames().size(), 3u);
}

TEST_F(GraphPieceTest, ALoopLeadsBackFromAFrameOfTheMapOrThePiece) {
  EXPECT_EQ(check_loop_ends(7, 7).to_string(), "INVALID_ARGUMENT: it leads from a frame to itself");
  EXPECT_EQ(check_loop_ends(2, 7).to_string(), "INVALID_ARGUMENT: query must be the later frame");
  EXPECT_TRUE(check_loop_ends(7, 2).ok());
  for (const std::uint32_t query : {9u, 14u, 15u}) {
    GraphPiece next = piece(10, 15);
    next.add_loop(loop_between(query, 2));
    EXPECT_EQ(next.fit(map_of_session()).ok(), query < 15) << query;
  }
  GraphPiece beyond = piece(0, 10);
  beyond.add_loop(loop_between(10, 2));
  EXPECT_EQ(beyond.fit(place::HandMadeGraph()).to_string(),
            "NO_SUCH_FRAME: a loop from frame 10, which does not exist");
}

TEST_F(GraphPieceTest, EndsOfALoopMoreThan10000KmApartAreRefused) {
  EXPECT_TRUE(check_loop_motion({Matrix3::Identity(), {1e7, 0, 0}}).ok());
  EXPECT_EQ(check_loop_motion({Matrix3::Identity(), {1.1e7, 0, 0}}).reason(), Reason::BAD_MOTION);
  EXPECT_EQ(check_loop_motion({Matrix3::Identity(), {std::numeric_limits<double>::quiet_NaN(), 0, 0}}).reason(),
            Reason::BAD_MOTION);
}

// A running map whose queue can be filled.
class GraphPieceWrite : public GraphPieceTest {
 protected:
  // Sanitized builds take their time.
  static std::chrono::steady_clock::time_point soon() {
    return std::chrono::steady_clock::now() + std::chrono::seconds(600);
  }
  // Begins the session, and then takes all the room of the queue.
  void begin_and_fill(GraphPiece& piece) {
    session_ = piece.begin(*mapper_).or_throw();
    ASSERT_TRUE(mapper_->wait_idle(soon()).ok());
    budget_->charge(storage::Share::kQueues, room_);
  }
  void make_room() { budget_->release(storage::Share::kQueues, room_); }

  const std::shared_ptr<storage::Budget> budget_ = std::make_shared<storage::Budget>(std::size_t{64} << 20);
  const std::size_t room_ = budget_->allowance(storage::Share::kQueues);
  const std::unique_ptr<Mapper> mapper_ = Mapper::open(storage::make_memory_engine(), budget_, nullptr, {}).or_throw();
  SessionNumber session_ = 0;
};

TEST_F(GraphPieceWrite, WaitsForRoomInTheQueueAndUntilAllIsApplied) {
  GraphPiece whole = piece(0, 5);
  storage::ClosureProposalRecord loop = loop_between(4, 1);
  loop.verification = storage::Verification::kImported;
  whole.add_loop(std::move(loop));
  begin_and_fill(whole);
  const std::uint64_t before = mapper_->stats().durable_sequence;
  int asked = 0;
  const auto last = whole.write(*mapper_, soon(), [&]() -> Status {
    if (++asked == 2) make_room();
    return {};
  });
  ASSERT_TRUE(last.ok()) << last.status().to_string();
  EXPECT_GE(asked, 2);
  EXPECT_GE(*last, before + 6);
  const auto view = mapper_->view();
  EXPECT_EQ(view->session(session_)->frames, 5u);
  const auto hot = view->hot({session_, 4});
  ASSERT_TRUE(hot);
  ASSERT_EQ(hot->edges.size(), 2u) << "the odometry and the loop";
  EXPECT_EQ(hot->edges[1].a, (FrameId{session_, 1}));

  // A piece of which the map holds all frames has nothing to write.
  GraphPiece again = piece(0, 5);
  ASSERT_TRUE(again.fit(*view).ok());
  EXPECT_EQ(again.begin(*mapper_).or_throw(), session_);
  EXPECT_EQ(again.write(*mapper_, soon(), [] { return Status(); }).or_throw(), 0u);
}

TEST_F(GraphPieceWrite, EndsWhenItMayNotProceed) {
  GraphPiece whole = piece(0, 5);
  begin_and_fill(whole);
  const auto last = whole.write(*mapper_, soon(), [] { return Status(Reason::SHUTTING_DOWN, "the caller has gone"); });
  EXPECT_EQ(last.status().to_string(), "SHUTTING_DOWN: the caller has gone");
  EXPECT_EQ(mapper_->view()->session(session_)->frames, 0u);
  make_room();
}

TEST_F(GraphPieceTest, IndicesBeyondTheLargestAreRefused) {
  EXPECT_TRUE(GraphPiece::make(imported_header(), 4'294'967'293, 1).ok());
  EXPECT_EQ(GraphPiece::make(imported_header(), 4'294'967'293, 2).status().to_string(),
            "INVALID_ARGUMENT: frames beyond index 4294967293");
}

}  // namespace
}  // namespace relmap::map
