#include "server/ops/daemon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace relmap {
namespace {

class DaemonTest : public testing::Test {
 protected:
  DaemonTest() : folder_(testing::TempDir() + "relmapd_" + std::to_string(getpid())) {
    std::filesystem::remove_all(folder_);
    config_.data = folder_ + "/map";
    config_.listen = "127.0.0.1:0";
    config_.memory_budget_mb = 64;
  }
  ~DaemonTest() override { std::filesystem::remove_all(folder_); }

  std::string endpoint() const {
    std::ostringstream text;
    text << std::ifstream(config_.data + "/endpoint").rdbuf();
    return text.str();
  }

  const std::string folder_;
  Config config_;
};

TEST_F(DaemonTest, SaysWhereItServesAndTakesItBackWhenItStops) {
  auto daemon = Daemon::start(config_);
  ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  EXPECT_THAT(endpoint(), testing::HasSubstr("address " + (*daemon)->address() + "\npid " + std::to_string(getpid())));
  (*daemon)->tick();
  EXPECT_TRUE((*daemon)->stop().ok());
  EXPECT_FALSE(std::filesystem::exists(config_.data + "/endpoint"));
}

TEST_F(DaemonTest, TheFolderIsFreeAgainAfterwards) {
  for (int run = 0; run < 2; ++run) {
    auto daemon = Daemon::start(config_);
    ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  }
}

TEST_F(DaemonTest, ASecondOneOnTheFolderFailsByNameAndLeavesTheFirstAlone) {
  auto first = Daemon::start(config_);
  ASSERT_TRUE(first.ok());
  const std::string before = endpoint();
  EXPECT_EQ(Daemon::start(config_).reason(), Reason::FOLDER_LOCKED);
  EXPECT_EQ(endpoint(), before);
}

TEST_F(DaemonTest, ASecondOneOnThePortFailsByName) {
  auto first = Daemon::start(config_);
  ASSERT_TRUE(first.ok());
  Config second = config_;
  second.data = folder_ + "/other";
  second.listen = (*first)->address();
  EXPECT_EQ(Daemon::start(second).reason(), Reason::PORT_IN_USE);
  EXPECT_FALSE(std::filesystem::exists(second.data + "/endpoint"));
}

TEST_F(DaemonTest, RefusesWhatItCannotServe) {
  Config config = config_;
  config.listen = "0.0.0.0:0";
  EXPECT_EQ(Daemon::start(config).reason(), Reason::BAD_CONFIG);
  config = config_;
  config.vocabulary = folder_ + "/nowhere.vocab";
  EXPECT_EQ(Daemon::start(config).reason(), Reason::NO_SUCH_FILE);
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ + "/file") << "no folder";
  config = config_;
  config.data = folder_ + "/file";
  EXPECT_EQ(Daemon::start(config).reason(), Reason::IO_ERROR);
}

TEST_F(DaemonTest, ServesWithoutLcmIfThatCannotStart) {
  config_.lcm = "nonsense://";
  auto daemon = Daemon::start(config_);
  ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  EXPECT_TRUE((*daemon)->stop().ok());
}

}  // namespace
}  // namespace relmap
