#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/keyframe_file.h"
#include "frontend/console.h"
#include "frontend/workflow/testing/workflow_fixture.h"
#include "frontend/workflow/workflows.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap::workflow {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

// Five keyframes of one session called morning.
std::vector<Keyframe> recorded_keyframes() {
  KeyframeSampler sampler(3);
  std::vector<Keyframe> keyframes;
  for (std::uint32_t i = 0; i < 5; ++i) {
    Keyframe& keyframe = keyframes.emplace_back(sampler.keyframe());
    if (i > 0) keyframe.session = keyframes.front().session;
    keyframe.sequence = i;
  }
  return keyframes;
}

class ReplayKeyframesTest : public WorkflowTest {
 protected:
  ReplayKeyframesTest() {
    options_.path = file("drive.bin");
    auto writer = capture::KeyframeFileWriter::create(options_.path).or_throw();
    for (const Keyframe& keyframe : keyframes_) EXPECT_TRUE(writer.write(keyframe).ok());
    EXPECT_TRUE(writer.close().ok());

    outside_.logs.open = [this](const std::string& path, const std::string& choice) -> Result<Logs::Session> {
      EXPECT_EQ(path, options_.path);
      EXPECT_EQ(choice, options_.recorded);
      if (!no_log_.ok()) return no_log_;
      Logs::Session session;
      session.header = keyframes_[0].session;
      session.next = [this, next = std::size_t{0}]() mutable -> Result<std::optional<Keyframe>> {
        if (next < keyframes_.size()) return std::optional(keyframes_[next++]);
        if (!log_end_.ok()) return log_end_;
        return std::optional<Keyframe>();
      };
      session.left_out = [] { return std::map<Reason, std::uint64_t>{{Reason::DATA_LOSS, 2}}; };
      return session;
    };
  }

  std::vector<Keyframe> keyframes_ = recorded_keyframes();
  Status no_log_, log_end_;
};

TEST_F(ReplayKeyframesTest, EveryKeyframeOfAFileIsSentAsOneOfANewSession) {
  ASSERT_TRUE(run(replay_file).ok());
  ASSERT_EQ(daemon_.pushed.size(), 5u);
  const SessionHeader& session = daemon_.pushed[0].session;
  EXPECT_NE(session.uuid, keyframes_[0].session.uuid);
  EXPECT_EQ(session.robot, "cart");
  EXPECT_EQ(session.name, "drive.bin");
  EXPECT_EQ(daemon_.pushed[4].tracks.size(), keyframes_[4].tracks.size());
  EXPECT_TRUE(summary_.ready_made);
  EXPECT_EQ(summary_.pairs, 5u);
  EXPECT_EQ(summary_.recording->count, 5u);
  EXPECT_EQ(daemon_.complete, true);
  EXPECT_EQ(exit_code(), kDone);
  EXPECT_THAT(frontend::summary_json(summary_), HasSubstr("\"keyframes\":5,"));
}

TEST_F(ReplayKeyframesTest, UsesTheRecordedRobotUnlessAnotherIsGiven) {
  options_.robot.clear();
  ASSERT_TRUE(run(replay_file).ok());
  EXPECT_EQ(summary_.robot, keyframes_[0].session.robot);
}

TEST_F(ReplayKeyframesTest, SendsTheKeyframesBeforeADamageAndFails) {
  std::filesystem::resize_file(options_.path, std::filesystem::file_size(options_.path) - 3);
  const Status status = run(replay_file);
  EXPECT_EQ(status.reason(), Reason::TRUNCATED);
  EXPECT_EQ(daemon_.pushed.size(), 4u);
  EXPECT_EQ(daemon_.complete, false);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(ReplayKeyframesTest, AnEmptyFileHoldsNoKeyframe) {
  std::filesystem::resize_file(options_.path, 0);
  EXPECT_EQ(run(replay_file).to_string(), "BAD_SIZE: " + options_.path + " holds no keyframe");
  EXPECT_EQ(daemon_.opened.size(), 0u);
}

TEST_F(ReplayKeyframesTest, KeyframesHaveNoPairsToReport) {
  options_.report = file("pairs.tsv");
  EXPECT_EQ(run(replay_file).reason(), Reason::UNSUPPORTED);
  EXPECT_FALSE(std::filesystem::exists(options_.report));
  options_.report.clear();
  options_.all_keyframes = true;
  EXPECT_EQ(run(replay_log).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(ReplayKeyframesTest, EndsInOrderWhenStopped) {
  daemon_.pushed_one = [this](std::size_t count) { stop_ = stop_ || count == 3; };
  ASSERT_TRUE(run(replay_file).ok());
  EXPECT_EQ(daemon_.pushed.size(), 3u);
  EXPECT_EQ(daemon_.complete, false);
  EXPECT_EQ(daemon_.ends, 0);
  EXPECT_EQ(exit_code(), kInterrupted);
}

TEST_F(ReplayKeyframesTest, EndsWhenAKeyframeIsRefused) {
  daemon_.takes = 2;
  daemon_.refuses_to_push = {Reason::IO_ERROR, "the spool is full"};
  EXPECT_EQ(run(replay_file).reason(), Reason::IO_ERROR);
  EXPECT_EQ(summary_.keyframes, 2u);
  EXPECT_FALSE(daemon_.complete.has_value());
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(ReplayKeyframesTest, PassesOverKeyframesThatTheSpoolKnows) {
  daemon_.last = keyframes_[2];
  ASSERT_TRUE(run(replay_file).ok());
  ASSERT_EQ(daemon_.pushed.size(), 2u);
  EXPECT_EQ(daemon_.pushed[0].sequence, 3u);
  EXPECT_EQ(summary_.gone_on, 2u);
}

TEST_F(ReplayKeyframesTest, SendsTheChosenSessionOfALog) {
  options_.recorded = "morning";
  options_.as_recorded = true;
  ASSERT_TRUE(run(replay_log).ok());
  EXPECT_EQ(daemon_.pushed.size(), 5u);
  EXPECT_EQ(summary_.session, "morning");
  EXPECT_EQ(summary_.uuid, keyframes_[0].session.uuid.to_string());
  EXPECT_THAT(summary_.spool, EndsWith("cart.morning." + summary_.uuid)) << "a log may hold several of that name";
  EXPECT_EQ(summary_.unreadable.at(Reason::DATA_LOSS), 2u);
  EXPECT_FALSE(summary_.recording.has_value());
  EXPECT_EQ(exit_code(), kDone);
}

TEST_F(ReplayKeyframesTest, ASessionThatALogDoesNotHoldIsWrongUsage) {
  no_log_ = {Reason::NO_SUCH_SESSION, "evening"};
  options_.recorded = "evening";
  EXPECT_EQ(run(replay_log).reason(), Reason::NO_SUCH_SESSION);
  EXPECT_EQ(exit_code(), kUsage);
}

TEST_F(ReplayKeyframesTest, SendsTheKeyframesBeforeTheDamagedEndOfALogAndFails) {
  log_end_ = {Reason::CORRUPT, "damaged to its end"};
  EXPECT_EQ(run(replay_log).reason(), Reason::CORRUPT);
  EXPECT_EQ(daemon_.pushed.size(), 5u);
  EXPECT_EQ(daemon_.complete, false);
  EXPECT_EQ(exit_code(), kFailed);
}

}  // namespace
}  // namespace relmap::workflow
