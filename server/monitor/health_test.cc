#include "server/monitor/health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relmap::monitor {
namespace {

using ::testing::HasSubstr;

Status of(const rpc::HealthFacts& health, const std::string& name) {
  for (const rpc::ComponentHealth& component : health.components)
    if (component.name == name) return component.state;
  ADD_FAILURE() << name;
  return {};
}

TEST(Health, IsGoodWhereThreadsWorkAndTheDiskTakesWhatComes) {
  Signs signs;
  signs.map.journal_s = signs.map.worker_s = signs.map.commit_s = signs.intake_s = signs.map.queued_s = 2.9;
  const rpc::HealthFacts health = judge(signs);
  EXPECT_TRUE(health.live);
  EXPECT_TRUE(health.ready());
  EXPECT_EQ(in_short(health), "ok");
  EXPECT_EQ(health_page(health, true), "ok\nstorage: ok\nworker: ok\nintake: ok\n");
}

TEST(Health, TellsStorageWorkerAndIntakeApart) {
  Signs signs;
  signs.map.journal_s = 4;
  EXPECT_EQ(of(judge(signs), "storage").reason(), Reason::STALLED);
  EXPECT_TRUE(of(judge(signs), "worker").ok());
  EXPECT_TRUE(of(judge(signs), "intake").ok());
  signs = {};
  signs.map.commit_s = 4;
  EXPECT_THAT(of(judge(signs), "storage").message(), HasSubstr("a commit has been waiting for the disk for 4.0 s"));
  signs = {};
  signs.map.worker_s = 4;
  EXPECT_TRUE(of(judge(signs), "storage").ok());
  EXPECT_EQ(of(judge(signs), "worker").reason(), Reason::STALLED);
  signs = {};
  signs.map.queued_s = 4;
  EXPECT_EQ(of(judge(signs), "worker").reason(), Reason::STALLED);
  signs = {};
  signs.intake_s = 4;
  EXPECT_EQ(of(judge(signs), "intake").reason(), Reason::STALLED);
  signs = {};
  signs.lcm = {Reason::NO_MULTICAST_ROUTE, "no route"};
  EXPECT_EQ(of(judge(signs), "intake").reason(), Reason::NO_MULTICAST_ROUTE);
  EXPECT_FALSE(judge(signs).ready());
  EXPECT_TRUE(judge(signs).live);
  EXPECT_EQ(health_page(judge(signs), true),
            "not ready\nstorage: ok\nworker: ok\nintake: NO_MULTICAST_ROUTE: no route\n");
  EXPECT_EQ(health_page(judge(signs), false), "ok\nstorage: ok\nworker: ok\nintake: NO_MULTICAST_ROUTE: no route\n");
}

TEST(Health, NamesTheReasonOfADiskThatTakesNothing) {
  Signs signs;
  signs.map.storage = {Reason::DISK_FULL, "12 MiB free"};
  EXPECT_EQ(in_short(judge(signs)), "storage: DISK_FULL: 12 MiB free");
  EXPECT_FALSE(judge(signs).ready());
  EXPECT_TRUE(judge(signs).live) << "a new start would not help";
}

TEST(Health, TellsOfAFullDiskBeforeSomebodyWrites) {
  Signs signs;
  signs.free_bytes = 100 << 20;
  signs.low_water = 256 << 20;
  EXPECT_EQ(in_short(judge(signs)), "storage: DISK_FULL: 100 MiB free; nothing is taken in below 256 MiB");
  signs.free_bytes = 256 << 20;
  EXPECT_TRUE(judge(signs).ready());
}

TEST(Health, IsDeadOnlyWhereANewStartMayHelp) {
  for (double Signs::*const busy : {&Signs::intake_s}) {
    Signs signs;
    signs.*busy = 10.1;
    EXPECT_FALSE(judge(signs).live);
  }
  for (double map::MapperProgress::*const busy : {&map::MapperProgress::journal_s, &map::MapperProgress::worker_s}) {
    Signs signs;
    signs.map.*busy = 9.9;
    EXPECT_TRUE(judge(signs).live);
    signs.map.*busy = 10.1;
    EXPECT_FALSE(judge(signs).live);
    EXPECT_FALSE(judge(signs).ready());
    signs.hung_after_s = 60;
    EXPECT_TRUE(judge(signs).live);
  }
  Signs slow;
  slow.map.commit_s = 100;
  EXPECT_TRUE(judge(slow).live) << "a large commit takes as long as the disk needs, while keyframes are taken in";
  slow.map.commit_s = 601;
  EXPECT_FALSE(judge(slow).live);
}

TEST(Health, TellsOfAClockThatWasSet) {
  rpc::HealthFacts health = judge({});
  health.clock_steps = 1;
  health.clock_step_s = -3600;
  health.clock_step_age_s = 12;
  EXPECT_EQ(health_page(health, true),
            "ok\nstorage: ok\nworker: ok\nintake: ok\nclock: set back by 3600.0 s, 12 s ago\n");
  health.clock_step_age_s = 3601;
  EXPECT_EQ(health_page(health, true), health_page(judge({}), true)) << "that is over";
}

TEST(Health, IsNotReadyWhileTheDaemonStops) {
  Signs signs;
  signs.stopping = true;
  EXPECT_EQ(of(judge(signs), "intake").reason(), Reason::SHUTTING_DOWN);
  EXPECT_FALSE(judge(signs).ready());
  EXPECT_TRUE(judge(signs).live);
}

}  // namespace
}  // namespace relmap::monitor
