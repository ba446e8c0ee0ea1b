// relmap-frontend over gRPC with a daemon that the test controls: interrupted batches, the end of a session,
// back-pressure.
#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "frontend/publishing/grpc/testing/fake_ingest.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

using Settled = std::map<std::uint32_t, std::uint32_t>;

class FrontendGrpc : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new storage::TemporaryFolder();
    record_simulation(*folder_ / "drive", {"--seed", "1", "--pairs", "40", "--laps", "0.3"});
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  void SetUp() override { daemon_.start(1); }

  std::vector<std::string> command(const std::string& source, std::vector<std::string> more = {}) const {
    std::vector<std::string> all{built_program("relmap-frontend"),
                                 source,
                                 "--robot",
                                 "cart",
                                 "--server",
                                 daemon_.address(),
                                 "--spool",
                                 "none",
                                 "--uuid",
                                 "7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Settled settled() {
    const auto held = daemon_.lock();
    return daemon_.settled;
  }
  // Killed when the daemon has so many.
  void break_off(const std::string& source, std::size_t keyframes) {
    Process process(command(source, {"--rate", "20"}), {});
    while (process.running() && settled().size() < keyframes)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(process.running());
    process.kill();
  }
  static bool says(const std::string& text, const std::string& what) { return text.find(what) != std::string::npos; }

  static std::string drive() { return *folder_ / "drive"; }

  static inline storage::TemporaryFolder* folder_ = nullptr;
  publishing::FakeIngest daemon_;
};

TEST_F(FrontendGrpc, AnInterruptedBatchGivesTheSameKeyframes) {
  const Finished whole = run_program(command(drive()));
  EXPECT_EQ(whole.exit_code, 0) << whole.standard_error;
  const Settled uninterrupted = settled();
  ASSERT_GE(uninterrupted.size(), 6u);

  daemon_.settled.clear();
  daemon_.order.clear();
  break_off(drive(), uninterrupted.size() / 2);
  const Settled half = settled();
  ASSERT_LT(half.size(), uninterrupted.size());
  const Finished again = run_program(command(drive(), {"--json"}));
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  EXPECT_TRUE(says(again.standard_output, "\"settled\":" + std::to_string(uninterrupted.size())))
      << again.standard_output;
  EXPECT_TRUE(says(again.standard_output, "\"spool\":null")) << again.standard_output;
  EXPECT_EQ(settled(), uninterrupted);
  EXPECT_EQ(daemon_.bad_payloads, 0u);
}

TEST_F(FrontendGrpc, AnInterruptedBatchOfReadyMadeKeyframesGivesTheSameKeyframes) {
  const std::string file = *folder_ / "keyframes.bin";
  ASSERT_EQ(run_program({built_program("relmap-frontend"), drive(), "--robot", "cart", "--out", file}).exit_code, 0);
  ASSERT_EQ(run_program(command(file)).exit_code, 0);
  const Settled uninterrupted = settled();
  daemon_.settled.clear();
  break_off(file, 2);
  EXPECT_EQ(run_program(command(file)).exit_code, 0);
  EXPECT_EQ(settled(), uninterrupted);
}

TEST_F(FrontendGrpc, AnotherRecordingUnderTheSameUuidIsRefused) {
  daemon_.settled = {{0, 1}, {1, 2}, {2, 3}};
  const Finished refused = run_program(command(drive(), {"--rate", "20"}));
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(says(refused.standard_error, "SEQUENCE_CONFLICT")) << refused.standard_error;
  EXPECT_EQ(settled().size(), 3u);
}

TEST_F(FrontendGrpc, OnlyASourceThatEndedEndsItsSession) {
  break_off(drive(), 2);
  Process interrupted(command(drive(), {"--rate", "20"}), {});
  while (interrupted.running() && settled().size() < 4) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  interrupted.signal(SIGINT);
  EXPECT_EQ(interrupted.wait(kPatience), 4);
  {
    const auto held = daemon_.lock();
    EXPECT_TRUE(daemon_.ends.empty());
  }
  EXPECT_EQ(run_program(command(drive())).exit_code, 0);
  const auto held = daemon_.lock();
  EXPECT_FALSE(daemon_.ends.empty());
  for (const std::uint64_t end : daemon_.ends) EXPECT_EQ(end, daemon_.settled.size());
}

TEST_F(FrontendGrpc, ReportsThatTheDaemonAsksForLess) {
  v1::IngestReply slow;
  SessionUuid uuid = *SessionUuid::parse("7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11");
  slow.mutable_pace()->set_session_uuid(uuid_to_wire(uuid));
  slow.mutable_pace()->set_rate_hz(0.5);
  daemon_.manners.between = {slow};
  const Finished live = run_program(command(drive(), {"--live", "--rate", "20", "--json"}));
  EXPECT_EQ(live.exit_code, 0) << live.standard_error;
  const std::string& told = live.standard_error;
  const std::size_t first = told.find("asks for at most 0.5 keyframes/s");
  EXPECT_NE(first, std::string::npos) << told;
  EXPECT_EQ(told.find("asks for at most", first + 1), std::string::npos) << told;
  EXPECT_TRUE(says(live.standard_output, "\"slow_downs\":1")) << live.standard_output;
}

}  // namespace
}  // namespace relmap::testing
