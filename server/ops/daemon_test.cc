#include "server/ops/daemon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <span>
#include <sstream>

#include "server/ops/signals.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/map/map.h"
#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap::ops {
namespace {

class DaemonTest : public testing::Test {
 protected:
  DaemonTest() : folder_(testing::TempDir() + "relmapd_" + std::to_string(getpid())) {
    std::filesystem::remove_all(folder_);
    config_.data = folder_ + "/map";
    config_.listen = "127.0.0.1:0";
    config_.insecure = true;
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

TEST_F(DaemonTest, WritesTheEndpointFileAndRemovesItWhenItStops) {
  auto daemon = Daemon::start(config_);
  ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  EXPECT_THAT(endpoint(), testing::HasSubstr("address " + (*daemon)->address() + "\npid " + std::to_string(getpid())));
  EXPECT_THAT(endpoint(), testing::StartsWith("socket " + config_.data + "/socket\n"));
  EXPECT_TRUE(std::filesystem::is_socket(config_.data + "/socket"));
  (*daemon)->tick();
  EXPECT_TRUE((*daemon)->stop().ok());
  EXPECT_FALSE(std::filesystem::exists(config_.data + "/endpoint"));
  EXPECT_FALSE(std::filesystem::exists(config_.data + "/socket"));
}

TEST_F(DaemonTest, ServesOnlyAtItsSocketUnlessToldOtherwise) {
  config_.listen = Config().listen;
  config_.insecure = false;
  auto daemon = Daemon::start(config_);
  ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  EXPECT_EQ((*daemon)->address(), "");
  EXPECT_THAT(endpoint(), testing::Not(testing::HasSubstr("address")));
}

TEST_F(DaemonTest, ReleasesTheFolderWhenItStops) {
  for (int run = 0; run < 2; ++run) {
    auto daemon = Daemon::start(config_);
    ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  }
}

// A map that a program without digests wrote to last, and a signal that comes while the daemon starts.
TEST_F(DaemonTest, StopsWhileItMakesDigestsAndMakesThemAtTheNextStart) {
  {
    auto daemon = Daemon::start(config_);
    ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  }
  const auto digests_hold = [&](bool forget) {
    const auto engine = storage::open_rocksdb(config_.data, {}).or_throw();
    const std::uint64_t epoch = engine->acquire().or_throw();
    const auto map = storage::Map::open(engine, epoch, std::make_shared<storage::Budget>(64u << 20)).or_throw();
    if (forget) {
      storage::Session session;
      session.number = session.frames = 1;
      map->add_session(session);
      map->add_frame({1, 0}, {}, {}, {});
      map->state().keyframes = 1;
      EXPECT_TRUE(map->commit().ok());
      storage::MapState state = map->state();
      state.digests_commit = 0;
      const storage::Put put{storage::keys::map_state(), storage::encode_state(state)};
      EXPECT_TRUE(engine->commit(epoch, engine->applied_sequence(), std::span(&put, 1), {}).ok());
    }
    return map->digests_hold();
  };
  digests_hold(/*forget=*/true);
  EXPECT_FALSE(digests_hold(/*forget=*/false));
  block_stop_signals();
  EXPECT_FALSE(is_told_to_stop());
  raise(SIGHUP);
  EXPECT_FALSE(is_told_to_stop()) << "which is no reason to stop";
  raise(SIGTERM);
  EXPECT_TRUE(is_told_to_stop());
  EXPECT_EQ(Daemon::start(config_).reason(), Reason::SHUTTING_DOWN);
  EXPECT_EQ(wait_for_signal(std::chrono::milliseconds(0)), SIGHUP);
  EXPECT_EQ(wait_for_signal(std::chrono::milliseconds(0)), SIGTERM);
  EXPECT_FALSE(is_told_to_stop());
  EXPECT_FALSE(digests_hold(/*forget=*/false));
  EXPECT_FALSE(std::filesystem::exists(config_.data + "/endpoint"));
  auto daemon = Daemon::start(config_);
  ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  EXPECT_TRUE((*daemon)->stop().ok());
  daemon->reset();
  EXPECT_TRUE(digests_hold(/*forget=*/false));
}

TEST_F(DaemonTest, ASecondDaemonOnTheFolderFailsAndDoesNotDisturbTheFirst) {
  auto first = Daemon::start(config_);
  ASSERT_TRUE(first.ok());
  const std::string before = endpoint();
  const Status refused = Daemon::start(config_).status();
  EXPECT_EQ(refused.reason(), Reason::FOLDER_LOCKED);
  EXPECT_THAT(refused.message(), testing::EndsWith("is owned by process " + std::to_string(getpid())));
  EXPECT_EQ(endpoint(), before);
}

TEST_F(DaemonTest, ASecondDaemonOnThePortFails) {
  auto first = Daemon::start(config_);
  ASSERT_TRUE(first.ok());
  Config second = config_;
  second.data = folder_ + "/other";
  second.listen = (*first)->address();
  EXPECT_EQ(Daemon::start(second).reason(), Reason::PORT_IN_USE);
  EXPECT_FALSE(std::filesystem::exists(second.data + "/endpoint"));
}

TEST_F(DaemonTest, RefusesUnusableConfigurations) {
  Config config = config_;
  config.insecure = false;
  EXPECT_EQ(Daemon::start(config).reason(), Reason::BAD_CONFIG) << "TCP needs TLS, also within this machine";
  config.credentials = folder_ + "/nowhere";
  complete_config(config);
  EXPECT_EQ(Daemon::start(config).reason(), Reason::BAD_CONFIG);
  EXPECT_EQ(Daemon::check(config).reason(), Reason::BAD_CONFIG);
  config = config_;
  config.lcm = "udpm://239.255.76.67:7667?ttl=0";
  config.lcm_key = folder_ + "/lcm.key";
  config.access = folder_ + "/access";
  EXPECT_EQ(Daemon::check(config).reason(), Reason::BAD_CONFIG) << "the files are not there";
  config = config_;
  config.vocabulary = folder_ + "/nowhere.vocab";
  EXPECT_EQ(Daemon::start(config).reason(), Reason::NO_SUCH_FILE);
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ + "/file") << "no folder";
  config = config_;
  config.data = folder_ + "/file";
  EXPECT_EQ(Daemon::start(config).reason(), Reason::IO_ERROR);
}

TEST_F(DaemonTest, ServesWithoutLcmIfLcmCannotStart) {
  std::filesystem::create_directories(folder_ + "/log");  // LCM reads no folder
  config_.lcm = "file://" + folder_ + "/log";
  config_.lcm_authentication = ingest::LcmAuthentication::Who::kNobody;
  auto daemon = Daemon::start(config_);
  ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
  EXPECT_TRUE((*daemon)->stop().ok());
}

TEST_F(DaemonTest, AFolderOfOtherFilesIsRefusedAndNotWrittenTo) {
  const auto names = [&] {
    std::set<std::string> all;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ + "/pictures"))
      all.insert(entry.path().string());
    return all;
  };
  std::filesystem::create_directories(folder_ + "/pictures/map");  // a folder that only has the name of a map's
  std::ofstream(folder_ + "/pictures/a.jpg") << "a picture";
  std::ofstream(folder_ + "/pictures/map/b.jpg") << "another";
  const auto before = names();
  config_.data = folder_ + "/pictures";
  const Status refused = Daemon::start(config_).status();
  EXPECT_EQ(refused.reason(), Reason::NOT_A_MAP);
  EXPECT_THAT(refused.message(), testing::AllOf(testing::HasSubstr(config_.data), testing::HasSubstr("a.jpg, map")));
  EXPECT_EQ(Daemon::check(config_).reason(), Reason::NOT_A_MAP);
  EXPECT_EQ(names(), before);
  std::ofstream(folder_ + "/pictures/FORMAT") << "of the pictures: 4 by 3\n";
  EXPECT_EQ(Daemon::start(config_).reason(), Reason::UNKNOWN_FORMAT_VERSION);
  EXPECT_EQ(names().size(), before.size() + 1);
}

// What an interrupted first start may leave behind, and the lost+found of a disk.
TEST_F(DaemonTest, EmptyMissingAndUnfinishedFoldersAreTaken) {
  std::filesystem::create_directories(config_.data + "/lost+found");
  for (const char* name : {"LOCK", "FORMAT.new"}) std::ofstream(config_.data + "/" + name) << "relm";
  EXPECT_TRUE(Daemon::check(config_).ok());
  for (const char* gone : {"RESERVE", "journal", "map"}) {
    auto daemon = Daemon::start(config_);
    ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
    EXPECT_TRUE((*daemon)->stop().ok());
    daemon->reset();
    EXPECT_TRUE(Daemon::check(config_).ok());
    std::filesystem::remove_all(config_.data + "/" + gone);  // as if the power had failed before it was there
    if (gone == std::string("journal")) std::filesystem::remove_all(config_.data + "/map");
  }
  auto daemon = Daemon::start(config_);
  ASSERT_TRUE(daemon.ok()) << daemon.status().to_string();
}

TEST_F(DaemonTest, ConfigurationsThatCannotStartFailTheCheck) {
  EXPECT_TRUE(Daemon::check(config_).ok());
  EXPECT_FALSE(std::filesystem::exists(config_.data)) << "to check is to write nothing";
  Config config = config_;
  config.lcm = "foo";
  EXPECT_EQ(Daemon::check(config).reason(), Reason::BAD_CONFIG);
  EXPECT_EQ(Daemon::start(config).reason(), Reason::BAD_CONFIG);
  EXPECT_FALSE(std::filesystem::exists(config_.data));
  config = config_;
  config.lcm = "udpm://239.255.76.67:7667?ttl=0";
  config.lcm_key = folder_ + "/lcm.key";
  config.access = folder_ + "/access";
  EXPECT_EQ(Daemon::check(config).reason(), Reason::BAD_CONFIG) << "the files are not there";
  config = config_;
  config.vocabulary = folder_ + "/nowhere.vocab";
  EXPECT_EQ(Daemon::check(config).reason(), Reason::NO_SUCH_FILE);
}

}  // namespace
}  // namespace relmap::ops
