// A session is deleted from the map of a daemon at work, which is killed meanwhile.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "server/map/derived.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr std::uint32_t kFrames = 400;

class SessionDeletion : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    options_.data = folder_ / "map";
    for (const int noise : {1, 2, 3}) {
      drives_.push_back(folder_ / ("drive-" + std::to_string(noise)));
      const Finished made = run_program({built_program("relmap-sim"), "points", "--out", drives_.back(), "--frames",
                                         std::to_string(kFrames), "--frames-per-lap", "300", "--appearance", "100",
                                         "--noise-seed", std::to_string(noise)});
      ASSERT_EQ(made.exit_code, 0) << made.standard_error;
    }
  }

  Finished relmap(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", options_.data});
    return run_program(arguments);
  }
  Finished ingest(std::vector<std::string> drives, const std::vector<std::string>& more = {}) const {
    drives.insert(drives.begin(), "ingest");
    drives.insert(drives.end(), more.begin(), more.end());
    return relmap(drives);
  }
  std::uint32_t frames_of(client::Client& client, SessionNumber number) const {
    const auto sessions = client.sessions().or_throw();
    const auto found =
        std::find_if(sessions.begin(), sessions.end(), [&](const auto& session) { return session.number == number; });
    return found == sessions.end() ? 0 : static_cast<std::uint32_t>(found->frames);
  }

  const storage::TemporaryFolder folder_;
  DaemonOptions options_;
  std::vector<std::string> drives_;
};

TEST_F(SessionDeletion, GoesOnByItselfAfterKillsAndLeavesTheOthersWhole) {
  auto daemon = std::make_unique<RunningDaemon>(options_);
  const Finished ingested = ingest(drives_, {"--jobs", "1"});
  ASSERT_EQ(ingested.exit_code, 0) << ingested.standard_error;
  ASSERT_TRUE(daemon->client()->wait_idle().ok());
  ASSERT_EQ(frames_of(*daemon->client(), 2), kFrames);

  EXPECT_EQ(relmap({"session", "delete", "nowhere", "--yes"}).exit_code, 1);
  EXPECT_THAT(relmap({"session", "delete", "2"}).standard_error, HasSubstr("--yes"));
  EXPECT_EQ(frames_of(*daemon->client(), 2), kFrames);

  std::vector<std::uint32_t> seen{kFrames};
  for (int kill = 0; kill < 4 && seen.back() > 0; ++kill) {
    Process deleting({built_program("relmap"), "--server", options_.data, "session", "delete", "2", "--yes"}, {});
    const std::uint32_t before = seen.back();
    const auto client = daemon->client();
    const auto until = std::chrono::steady_clock::now() + kPatience;
    while (frames_of(*client, 2) == before && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(milliseconds(2));
    daemon->process().kill();
    deleting.wait(kPatience);
    daemon = std::make_unique<RunningDaemon>(options_);
    seen.push_back(frames_of(*daemon->client(), 2));
    EXPECT_LT(seen.back(), before) << "what a reader has seen to go may come back until it is committed, but the "
                                      "journal has it";
  }
  // Nobody asks; the daemon goes on.
  ASSERT_TRUE(daemon->client()->wait_idle().ok());
  EXPECT_EQ(frames_of(*daemon->client(), 2), 0u);
  EXPECT_EQ(daemon->client()->sessions()->size(), 2u);
  const Finished again = relmap({"session", "delete", "2", "--yes"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.standard_error, HasSubstr("no session"));

  // The recording is not taken in again under its uuid, and the message says what to do.
  const Finished back = ingest({drives_[1]});
  EXPECT_EQ(back.exit_code, 1);
  EXPECT_THAT(back.standard_error + back.standard_output, HasSubstr("SESSION_DELETED"));
  EXPECT_THAT(back.standard_error + back.standard_output, HasSubstr("--again"));
  const Finished anew = ingest({drives_[1]}, {"--again"});
  EXPECT_EQ(anew.exit_code, 0) << anew.standard_error;
  ASSERT_TRUE(daemon->client()->wait_idle().ok());
  EXPECT_EQ(frames_of(*daemon->client(), 4), kFrames);
  EXPECT_EQ(daemon->stop(), 0);

  const Finished verified = run_program({built_program("relmap-admin"), "verify", options_.data});
  EXPECT_EQ(verified.exit_code, 0) << verified.standard_output << verified.standard_error;
  for (const char* command : {"verify", "stats"})
    EXPECT_THAT(run_program({built_program("relmap-admin"), "--json", command, options_.data}).standard_output,
                HasSubstr("\"sessions\":3,"))
        << command << " counts what there is, and not what is remembered of the one that was deleted";
  EXPECT_THAT(map::derived_differences(*open_stored_map(options_.data)), ::testing::IsEmpty());
}

}  // namespace
}  // namespace relmap::testing
