#include "frontend/workflow/delivery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "frontend/publishing/publish_transport.h"
#include "frontend/publishing/publisher.h"
#include "frontend/workflow/testing/workflow_fixture.h"

namespace relmap::workflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kRecorded = "street";

class DeliveryTest : public WorkflowTest {
 protected:
  // Delivers `count` keyframes, a metre apart, of a session called morning, and finishes.
  Status deliver(workflow::Run& run, std::uint32_t count, bool complete = true) {
    auto delivery = Delivery::open(run, session_called("morning"), kRecorded);
    if (!delivery.ok()) return delivery.status();
    for (std::uint32_t i = 0; i < count; ++i) {
      Keyframe keyframe;
      keyframe.session = (*delivery)->session();
      keyframe.sequence = i;
      keyframe.source = i == 0 ? MotionSource::kStart : MotionSource::kVision;
      keyframe.T_odom_frame.t.z() = i;
      if (Status status = (*delivery)->push(keyframe); !status.ok()) return status;
    }
    return (*delivery)->finish(complete);
  }
  Status deliver_all(std::uint32_t count, bool complete = true) {
    return run([&](workflow::Run& run) { return deliver(run, count, complete); });
  }
};

TEST_F(DeliveryTest, EveryKeyframeIsCountedSentAndSettled) {
  ASSERT_TRUE(deliver_all(3).ok());
  EXPECT_EQ(daemon_.pushed.size(), 3u);
  EXPECT_EQ(daemon_.complete, true);
  EXPECT_EQ(daemon_.patience, 7);
  EXPECT_EQ(daemon_.ends, 1) << "the session has ended";
  EXPECT_EQ(summary_.robot, "cart");
  EXPECT_EQ(summary_.session, "morning");
  EXPECT_EQ(summary_.uuid, daemon_.pushed[0].session.uuid.to_string());
  EXPECT_EQ(summary_.keyframes, 3u);
  EXPECT_EQ(summary_.steps, 2u);
  EXPECT_EQ(summary_.metric_steps, 2u);
  EXPECT_DOUBLE_EQ(summary_.path_m, 2);
  EXPECT_THAT(summary_.spool, HasSubstr("cart.morning"));
  EXPECT_EQ(summary_.publishing.settled, 3u);
  EXPECT_EQ(exit_code(), kDone);
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(DeliveryTest, FailsIfTheSinkDoesNotOpen) {
  daemon_.refuses_to_open = {Reason::CALIBRATION_CHANGED, "another camera"};
  EXPECT_EQ(deliver_all(3).reason(), Reason::CALIBRATION_CHANGED);
  EXPECT_EQ(summary_.keyframes, 0u);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(DeliveryTest, OpensNothingForARobotWithoutAName) {
  options_.robot.clear();
  EXPECT_EQ(deliver_all(3).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(daemon_.opened.size(), 0u);
  EXPECT_EQ(exit_code(), kUsage);
}

TEST_F(DeliveryTest, SendsARecordingOfAnotherMapFromItsBeginning) {
  daemon_.maps = {{Reason::WRONG_MAP, "the daemon serves another map"}};
  ASSERT_TRUE(deliver_all(1).ok());
  ASSERT_EQ(daemon_.opened.size(), 2u);
  EXPECT_FALSE(daemon_.opened[0].begin_anew);
  EXPECT_TRUE(daemon_.opened[1].begin_anew);
  EXPECT_EQ(said_, "the daemon serves another map: the recording is sent to it from its beginning\n");
}

TEST_F(DeliveryTest, DoesNotBeginALiveSessionOfAnotherMapAnew) {
  daemon_.maps = {{Reason::WRONG_MAP, "the daemon serves another map"}};
  options_.live = true;
  ASSERT_TRUE(deliver_all(1).ok());
  EXPECT_EQ(daemon_.opened.size(), 1u);
}

TEST_F(DeliveryTest, ASessionGoesOnAfterItsLastKeyframe) {
  daemon_.last.emplace().sequence = 41;
  options_.quiet = false;
  options_.publisher.spool = "/spool";
  ASSERT_TRUE(deliver_all(0).ok());
  EXPECT_EQ(summary_.gone_on, 41u);
  EXPECT_EQ(said_,
            "session morning goes on after keyframe 41, kept in /spool\n"
            "there is nothing after keyframe 41, with which the session goes on\n");
}

TEST_F(DeliveryTest, AStopInterruptsTheSinkAndWaitsForNothing) {
  daemon_.settles = false;
  daemon_.pushed_one = [&](std::size_t) { stop_ = true; };
  const Status status = run([&](workflow::Run& run) {
    Status pushed;
    for (; pushed.ok(); pushed = deliver(run, 1, false)) {
    }
    EXPECT_TRUE(run.was_interrupted(pushed)) << pushed.to_string();
    return Status();
  });
  EXPECT_TRUE(status.ok());
  EXPECT_TRUE(daemon_.interrupted);
  EXPECT_EQ(daemon_.patience, 0);
  EXPECT_EQ(daemon_.ends, 0);
  EXPECT_EQ(exit_code(), kInterrupted);
}

TEST_F(DeliveryTest, DoesNotEndASessionThatAnOperatorHasClosed) {
  daemon_.session = {Reason::SESSION_DELETED, "by its operator"};
  EXPECT_EQ(deliver_all(2).to_string(), "SESSION_DELETED: by its operator");
  EXPECT_EQ(daemon_.ends, 0) << "what an operator has closed is not ended by its robot";
  EXPECT_EQ(exit_code(), kFailed);
  daemon_.session = {Reason::SESSION_FROZEN, "by its operator"};
  EXPECT_TRUE(deliver_all(2).ok());
  EXPECT_EQ(daemon_.ends, 0);
}

TEST_F(DeliveryTest, ReportsWhatIsMissingInTheMap) {
  daemon_.settles = false;
  daemon_.answers = false;
  daemon_.trouble = {Reason::UNREACHABLE, "nobody listens"};
  daemon_.at_end.gaps = 5;
  daemon_.at_end.lost_in_restores = 3;
  options_.to = "grpc";
  options_.server = "map.lab:1";
  ASSERT_TRUE(deliver_all(2).ok());
  EXPECT_EQ(said_,
            "MAP_RESTORED: the map was restored from a backup; it lacks 3 keyframes that the spool has no more\n"
            "2 keyframes were given up: they are gaps in the map\n"
            "no relmapd answers on map.lab:1 (UNREACHABLE: nobody listens)\n");
  EXPECT_EQ(exit_code(), kUnsettled);
}

TEST_F(DeliveryTest, KeepsAndCountsTheRateThatTheDaemonAsksFor) {
  options_.quiet = false;
  const Status status = run([&](workflow::Run& run) {
    auto delivery = Delivery::open(run, session_called("morning"), kRecorded).or_throw();
    PoseNews news;
    news.kind = PoseNews::Kind::kSlowDown;
    news.rate_hz = 2;
    daemon_.tell(news);
    EXPECT_EQ(delivery->wanted_hz(), 2);
    news.kind = PoseNews::Kind::kResume;
    daemon_.tell(news);
    EXPECT_EQ(delivery->wanted_hz(), 0);
    return delivery->finish(true);
  });
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(summary_.slow_downs, 1u);
  EXPECT_EQ(said_, "the daemon asks for at most 2 keyframes/s\nthe daemon takes keyframes at any rate again\n");
}

TEST_F(DeliveryTest, AFileGetsItsNameOnlyWhenItIsComplete) {
  options_.to = "file";
  options_.out = file("keyframes.bin");
  ASSERT_TRUE(deliver_all(2, false).ok());
  EXPECT_EQ(said_, "the file is incomplete: " + options_.out + ".part has the keyframes so far\n");
  EXPECT_TRUE(std::filesystem::exists(options_.out + ".part"));
  EXPECT_FALSE(std::filesystem::exists(options_.out));
  ASSERT_TRUE(deliver_all(2).ok());
  EXPECT_THAT(said_, IsEmpty());
  EXPECT_TRUE(std::filesystem::exists(options_.out));
  EXPECT_EQ(summary_.spool, "") << "nothing waits anywhere";
  EXPECT_EQ(daemon_.opened.size(), 0u);
  EXPECT_EQ(exit_code(), kDone);
}

TEST_F(DeliveryTest, FailsIfTheFileCannotBeWritten) {
  options_.to = "file";
  options_.out = file("no such folder") + "/keyframes.bin";
  EXPECT_EQ(deliver_all(2).reason(), Reason::IO_ERROR);
  EXPECT_EQ(exit_code(), kFailed);
}

// A transport without a daemon at its other end.
class DeadTransport final : public publishing::PublishTransport {
 public:
  Status trouble() const override { return {Reason::UNREACHABLE, "nobody listens"}; }
  void send(const KeyframePart&) override {}
  void send(const Gap&) override {}
  void send(const SessionEnd&) override {}
  void listen(Listener) override {}
  void stop() override {}
};

TEST_F(DeliveryTest, LeavesKeyframesUnsettledWithoutADaemon) {
  options_.publisher.in_memory = true;
  options_.patience_s = 0;
  waits_.map_s = 0;
  outside_.open_daemon_sink = [](const RunOptions&, const publishing::PublisherOptions& publisher,
                                 const SessionHeader& session) {
    return frontend::sink_of(publishing::Publisher::start(publisher, session, std::make_unique<DeadTransport>()));
  };
  ASSERT_TRUE(deliver_all(2).ok());
  EXPECT_THAT(said_,
              HasSubstr("no relmapd answers on " + options_.publisher.lcm_url + " (UNREACHABLE: nobody listens"));
  EXPECT_EQ(summary_.publishing.unsettled, 2u);
  EXPECT_EQ(summary_.spool, "");
  EXPECT_EQ(exit_code(), kUnsettled);
}

}  // namespace
}  // namespace relmap::workflow
