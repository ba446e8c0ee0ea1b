#include "tools/relmap/top_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace relmap::cli {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

TopMoment moment(int second, std::uint64_t frames) {
  TopMoment now;
  now.at = std::chrono::steady_clock::time_point(std::chrono::seconds(second));
  now.status.version = "1";
  now.status.frames = frames;
  now.status.sessions = 2;
  now.status.relaxation_p50_us = 3200;
  now.status.lookup_lag = 17;
  now.status.lookup_lag_s = 4.2;
  now.status.memory_budget = 100 << 20;
  now.status.memory_used = 50 << 20;
  now.status.memory_shares = {{"dirty", 5 << 20, 10 << 20}, {"views", 0, 10 << 20}};
  client::Session session;
  session.number = 1;
  session.name = "morning";
  session.robot = "cart";
  session.frames = static_cast<std::uint32_t>(frames);
  now.sessions = {session, session};
  now.sessions[1].number = 2;
  now.sessions[1].state = client::SessionState::kFrozen;
  return now;
}

std::string shown(const TopMoment& now, const std::optional<TopMoment>& before = {}, TopLimits limits = {}) {
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_top(now, before, limits, console);
  EXPECT_EQ(err.str(), "");
  return out.str();
}

TEST(Top, ShowsTheWorkerSinceTheLastLookAndTheMemory) {
  const std::string text = shown(moment(12, 1500), moment(10, 1300));
  EXPECT_THAT(text, HasSubstr("100.0 frames/s"));
  EXPECT_THAT(text, HasSubstr("p50 3.2 ms"));
  EXPECT_THAT(text, HasSubstr("17 place lookups (4 s behind)"));
  EXPECT_THAT(text, HasSubstr("dirty 5.2 MB (50 %)"));
  EXPECT_THAT(text, Not(HasSubstr("views")));
  EXPECT_THAT(text, HasSubstr("2, 1 open, 1 frozen"));
  EXPECT_THAT(text, HasSubstr("+200"));
  EXPECT_THAT(shown(moment(10, 1300)), HasSubstr("- frames/s")) << "the first look knows no rate";
}

TEST(Top, RobotsInTroubleStandFirstAndSayWhy) {
  TopMoment now = moment(1, 1);
  client::RobotStatus well;
  well.uuid = "11111111-2222-3333-4444-555555555555";
  well.session = 1;
  well.robot = "a-well";
  well.name = "morning";
  well.keyframes_per_s = 4.96;
  well.lag_s = 0.041;
  well.next_sequence = 812;
  client::RobotStatus ill = well;
  ill.robot = "b-ill";
  ill.refused[Reason::TIME_BACKWARDS] = 3;
  ill.blocked = Reason::DISK_FULL;
  ill.lag_s.reset();
  client::RobotStatus stranger;
  stranger.uuid = "99999999-2222-3333-4444-555555555555";
  stranger.refused[Reason::NOT_ALLOWED] = 1;
  now.robots = {well, ill, stranger};
  const std::string text = shown(now);
  EXPECT_LT(text.find("b-ill"), text.find("a-well"));
  EXPECT_THAT(text, HasSubstr("3 TIME_BACKWARDS"));
  EXPECT_THAT(text, HasSubstr("DISK_FULL"));
  EXPECT_THAT(text, HasSubstr("0.04 s"));
  EXPECT_THAT(text, HasSubstr("812"));
  EXPECT_THAT(text, HasSubstr("(no name)  99999999"));
  EXPECT_THAT(shown(now, {}, {.robots = 1}), HasSubstr("... and 2 more"));
}

TEST(Top, RobotsOfOneNameAndThoseThatFellSilentAreNamed) {
  TopMoment now = moment(1, 1);
  client::RobotStatus well;
  well.uuid = "11111111-2222-3333-4444-555555555555";
  well.session = 1;
  well.robot = "a-well";
  client::RobotStatus silent = well;
  silent.robot = "b-silent";
  silent.silent = true;
  silent.silent_s = 312;
  client::RobotStatus one = well, other = well;
  one.robot = other.robot = "c-twice";
  one.same_name = {"99999999-2222-3333-4444-555555555555"};
  other.same_name = {well.uuid};
  now.robots = {well, silent, one, other};
  const std::string text = shown(now);
  EXPECT_THAT(text, HasSubstr("3 heard of in the last minute, 1 silent since"));
  EXPECT_THAT(text, ContainsRegex("c-twice .* SAME_NAME\n.*c-twice .* SAME_NAME\n.*b-silent .* 5 min 12 s .* silent\n"
                                  ".*a-well"));
}

TEST(Top, ReportsThatARobotSendsForAFrozenOrDeletedSession) {
  TopMoment now = moment(1, 1);
  client::RobotStatus robot;
  robot.robot = "cart";
  robot.session = 2;  // frozen
  robot.refused[Reason::SESSION_FROZEN] = 7;
  now.robots = {robot};
  EXPECT_THAT(shown(now), ContainsRegex("7 SESSION_FROZEN +SESSION_FROZEN"));
  now.sessions[1].state = client::SessionState::kOpen;  // thawed since
  EXPECT_THAT(shown(now), Not(ContainsRegex("SESSION_FROZEN +SESSION_FROZEN")));
  now.robots[0].refused.clear();
  now.robots[0].not_taken[Reason::SESSION_DELETED] = 1;
  EXPECT_THAT(shown(now), ContainsRegex("- +SESSION_DELETED"));
}

}  // namespace
}  // namespace relmap::cli
