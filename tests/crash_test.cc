// relmapd is killed again and again while keyframes come in over LCM; at the end each keyframe is in the map once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"
#include "tests/support/verify_findings.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct Length {
  int kills;
  std::uint32_t frames, frames_per_lap;
  int rate_hz;
};

class Crash : public ::testing::Test {
 protected:
  // Starts relmapd and kills it, at moments that `seed` chooses: while it serves, or (each fourth) while it recovers.
  void kill_often(const DaemonOptions& daemon, int kills, std::uint64_t seed, Process& frontend) {
    std::mt19937_64 random(seed);
    const auto up_to = [&](int ms) { return milliseconds(std::uniform_int_distribution<int>(0, ms)(random)); };
    for (int kill = 0; kill < kills; ++kill) {
      ASSERT_TRUE(frontend.running()) << "everything had come in before kill " << kill;
      const bool recovering = kill % 4 == 3;
      RunningDaemon running(daemon, recovering ? milliseconds(0) : milliseconds(30000));
      std::this_thread::sleep_for(up_to(recovering ? 200 : 700));
      ASSERT_TRUE(running.process().running()) << running.log();
      running.process().kill();
      verify_clean(daemon.data);
    }
  }

  // The map as the kill left it.
  static void verify_clean(const std::string& data) {
    storage::RocksDbOptions reading;
    reading.read_only = true;
    const auto engine = storage::open_rocksdb(data, reading).or_throw();
    EXPECT_THAT(verify_findings(*engine), ::testing::IsEmpty());
  }

  void feed_and_kill(const Length& length, std::uint64_t seed) {
    const std::string drive = folder_ / "drive";
    ASSERT_EQ(
        run_program({built_program("relmap-sim"), "points", "--out", drive, "--frames", std::to_string(length.frames),
                     "--frames-per-lap", std::to_string(length.frames_per_lap), "--appearance", "300"})
            .exit_code,
        0);
    const DaemonOptions options{.data = folder_ / "map", .lcm = random_lcm_url(), .more = {}};
    Process frontend({built_program("relmap-frontend"), "--source", "sim", drive, "--robot", "walker", "--lcm",
                      options.lcm, "--spool", folder_ / "spool", "--rate", std::to_string(length.rate_hz), "--quiet"},
                     {folder_ / "frontend.out", folder_ / "frontend.err"});
    kill_often(options, length.kills, seed, frontend);
    if (HasFatalFailure()) return;

    RunningDaemon survivor(options);
    EXPECT_EQ(frontend.wait(seconds(length.frames / length.rate_hz + 120)), 0) << read_text(folder_ / "frontend.err");
    Status idle(Reason::DEADLINE, "");  // thousands of places to look up may take longer than a call may
    for (int call = 0; call < 10 && idle.reason() == Reason::DEADLINE; ++call) idle = survivor.client()->wait_idle();
    ASSERT_TRUE(idle.ok()) << idle.to_string();
    const client::DaemonStatus status = survivor.client()->status().or_throw();
    EXPECT_EQ(status.frames, length.frames);
    EXPECT_EQ(status.gaps, 0u);
    EXPECT_EQ(status.refused, 0u);
    EXPECT_GT(status.closures_accepted, 0u);
    EXPECT_EQ(survivor.stop(), 0) << survivor.log();

    verify_clean(options.data);
    const auto map = open_stored_map(options.data);
    EXPECT_EQ(map->state().keyframes, length.frames);
    EXPECT_THAT(settled_once_differences(*map, read_keyframes(drive + "/keyframes.bin")), ::testing::IsEmpty());
  }

  const storage::TemporaryFolder folder_;
};

TEST_F(Crash, EveryKeyframeIsSettledOnceThoughTheDaemonIsKilledTwentyTimes) { feed_and_kill({20, 500, 250, 20}, 1); }

class LongCrash : public Crash {};

// Only two laps, since every further lap makes updates slower, and the test is about kills. The rate is low, so that
// keyframes still come in at the last kill on a busy machine, where verifying the map takes longer than making it.
TEST_F(LongCrash, EveryKeyframeIsSettledOnceThoughTheDaemonIsKilledTwoHundredTimes) {
  feed_and_kill({200, 8000, 4000, 12}, 2);
}

}  // namespace
}  // namespace relmap::testing
