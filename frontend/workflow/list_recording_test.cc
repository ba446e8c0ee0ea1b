#include "frontend/workflow/list_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/testing/picture_files.h"
#include "frontend/workflow/testing/workflow_fixture.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap::workflow {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ListRecordingTest : public WorkflowTest {
 protected:
  // Returns what list_recording() writes on standard output.
  std::string list() {
    ::testing::internal::CaptureStdout();
    status_ = list_recording(options_, outside_);
    return ::testing::internal::GetCapturedStdout();
  }

  Status status_;
};

TEST_F(ListRecordingTest, PrintsTheIdentityOfPairs) {
  options_.source = "kitti";
  EXPECT_THAT(list(), StartsWith("{\"fingerprint\":\"street\",\"count\":12,\"contents\":\""));
  EXPECT_TRUE(status_.ok());
  no_recording_ = {Reason::NO_SUCH_FILE, "nowhere"};
  EXPECT_EQ(list(), "");
  EXPECT_EQ(status_.reason(), Reason::NO_SUCH_FILE);
}

TEST_F(ListRecordingTest, PrintsTheSessionOfKeyframes) {
  options_.path = file("keyframes.bin");
  Keyframe keyframe = KeyframeSampler(1).keyframe();
  auto writer = capture::KeyframeFileWriter::create(options_.path).or_throw();
  ASSERT_TRUE(writer.write(keyframe).ok());
  ASSERT_TRUE(writer.close().ok());
  EXPECT_THAT(list(), AllOf(StartsWith("{\"uuid\":\"" + keyframe.session.uuid.to_string() + "\",\"robot\":"),
                            HasSubstr("\"name\":\"morning\""), HasSubstr("\"count\":1")));
}

TEST_F(ListRecordingTest, PrintsALineForEachSessionOfALog) {
  options_.source = "log";
  recording::RecordedSession session;
  session.header = session_called("morning");
  session.last = 41;
  Status no_log;
  outside_.logs.list = [&](const std::string&) -> Result<std::vector<recording::RecordedSession>> {
    if (!no_log.ok()) return no_log;
    return std::vector{session, session};
  };
  const std::string line =
      "{\"uuid\":\"" + SessionUuid().to_string() + "\",\"robot\":\"\",\"name\":\"morning\",\"first\":0,\"last\":41}\n";
  EXPECT_EQ(list(), line + line);
  no_log = {Reason::BAD_SIZE, "nothing of relmap's"};
  EXPECT_EQ(list(), "");
  EXPECT_EQ(status_.reason(), Reason::BAD_SIZE);
}

TEST_F(ListRecordingTest, PrintsALineForEachCameraOfPhotographs) {
  options_.mono = true;
  options_.path = file("tower");
  for (int i = 0; i < 2; ++i)
    capture::testing_files::write_picture(file("tower/" + std::to_string(i) + ".png"),
                                          capture::testing_files::noise(320, 240, CV_8UC1, i));
  EXPECT_THAT(list(),
              AllOf(StartsWith("{\"camera\":"), HasSubstr("\"pictures\":2"), HasSubstr("\"folders_passed_over\":[]")));
}

TEST_F(ListRecordingTest, RefusesALiveCamera) {
  options_.source = "iidc";
  EXPECT_EQ(list(), "");
  EXPECT_EQ(status_.to_string(), "INVALID_ARGUMENT: a live camera is no recording");
}

}  // namespace
}  // namespace relmap::workflow
