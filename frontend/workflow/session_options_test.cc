#include "frontend/workflow/session_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relmap::workflow {
namespace {

SessionHeader recorded_header() {
  SessionHeader header;
  header.uuid.bytes[0] = 9;
  header.robot = "recorded";
  header.name = "morning";
  return header;
}

TEST(SessionOptions, KeepRecordedNamesUnlessOthersAreGiven) {
  RunOptions options;
  EXPECT_EQ(session_header(options, recorded_header())->robot, "recorded");
  EXPECT_EQ(session_header(options, recorded_header())->name, "morning");
  options.robot = "cart";
  options.session = "evening";
  options.oneway = true;
  const SessionHeader header = session_header(options, recorded_header()).or_throw();
  EXPECT_EQ(header.robot, "cart");
  EXPECT_EQ(header.name, "evening");
  EXPECT_TRUE(header.oneway);
}

TEST(SessionOptions, ARobotWithoutANameIsWrongUsage) {
  SessionHeader nameless = recorded_header();
  nameless.robot.clear();
  const Status status = session_header({}, nameless).status();
  EXPECT_EQ(status.to_string(), "INVALID_ARGUMENT: the robot has no name: --robot gives it one");
  RunOptions options;
  options.session = "a\xff";
  EXPECT_EQ(session_header(options, recorded_header()).reason(), Reason::BAD_NAME);
}

TEST(SessionOptions, KeepTheRecordedUuidOnlyIfAsked) {
  RunOptions options;
  EXPECT_TRUE(session_header(options, recorded_header())->uuid.is_nil()) << "a new one";
  options.uuid = "7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11";
  EXPECT_EQ(session_header(options, recorded_header())->uuid.to_string(), options.uuid);
  options.uuid.clear();
  options.as_recorded = true;
  EXPECT_EQ(session_header(options, recorded_header())->uuid, recorded_header().uuid);
}

TEST(SessionOptions, AddToTheRecordingWhatMakesOtherKeyframesOfIt) {
  RunOptions options;
  const auto named = [&] { return publisher_options(options, recorded_header(), "street", "").recording; };
  EXPECT_EQ(named(), "street");
  options.all_keyframes = true;
  options.every = 3;
  options.picture = tracking::KeyframePicture::kSmall;
  EXPECT_EQ(named(), "street, all keyframes, small pictures, every 3");
  options = {};
  options.picture = tracking::KeyframePicture::kNone;
  EXPECT_EQ(named(), "street, no pictures");
}

TEST(SessionOptions, GiveEachSessionASpoolUnlessOneIsNamed) {
  RunOptions options;
  options.patience_s = 2.5;
  options.live = true;
  auto publisher = publisher_options(options, recorded_header(), "street", ".second");
  EXPECT_THAT(publisher.spool, ::testing::EndsWith("/relmap/spool/recorded.morning.second"));
  EXPECT_TRUE(publisher.live);
  EXPECT_EQ(publisher.patience.count(), 0) << "what is on disk waits for ever";
  options.publisher.spool = "/spool";
  options.publisher.in_memory = true;
  publisher = publisher_options(options, recorded_header(), "street", ".second");
  EXPECT_EQ(publisher.spool, "/spool");
  EXPECT_EQ(publisher.patience.count(), 2500);
}

}  // namespace
}  // namespace relmap::workflow
