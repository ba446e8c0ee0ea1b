#include "tools/relmap/status_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace relmap::cli {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

StatusMoment moment() {
  StatusMoment now;
  client::DaemonStatus& s = now.status;
  s.version = "1";
  s.pid = 4711;
  s.data_folder = "/var/lib/relmap";
  s.uptime_us = 3 * 3'600'000'000LL;
  s.sessions = 3;
  s.frames = 1'234'567;
  s.labels = 1;
  s.gaps = 4;
  s.memory_budget = 1 << 30;
  s.memory_used = 100 << 20;
  for (const char* name : {"dirty", "cache", "views", "engine", "place_index", "queues", "reassembly", "replies",
                           "sessions", "routes", "allocator", "pictures"})
    s.memory_shares.push_back({name, 1 << 20, 64 << 20});
  s.vocabulary_words = 10000;
  s.vocabulary_source = "relmap's shipped vocabulary. Made from: (1) photographs by many, CC-BY-SA-4.0; (2) GPL-2+.";
  return now;
}

std::string shown(const StatusMoment& now, bool all = false) {
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_status(now, all, console);
  EXPECT_EQ(err.str(), "");
  return out.str();
}

client::RobotStatus robot(const std::string& name) {
  client::RobotStatus r;
  r.robot = name;
  r.uuid = "11111111-2222-3333-4444-555555555555";
  r.session = 1;
  return r;
}

TEST(StatusView, IsOneScreenWithoutLicences) {
  StatusMoment now = moment();
  const std::string text = shown(now);
  EXPECT_THAT(text, StartsWith("nothing needs attention\n"));
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 24);
  EXPECT_THAT(text, HasSubstr("10,000 words: relmap's shipped vocabulary\n"));
  EXPECT_THAT(text, Not(HasSubstr("CC-BY")));
  EXPECT_THAT(text, HasSubstr("3 sessions, 1,234,567 frames"));
  EXPECT_THAT(text, HasSubstr("process 4711, up 3 h 00 min"));
  EXPECT_THAT(text, HasSubstr(", 1 label, 0 places\n"));
  EXPECT_THAT(text, ContainsRegex("storage +OK"));
  EXPECT_THAT(text, Not(HasSubstr("place_index")));
  EXPECT_THAT(text, Not(HasSubstr("explain")));
  const std::string all = shown(now, true);
  EXPECT_THAT(all, HasSubstr("CC-BY-SA-4.0"));
  EXPECT_THAT(all, HasSubstr("place_index"));
}

TEST(StatusView, WhatNeedsAttentionStandsFirst) {
  StatusMoment now = moment();
  now.status.storage = {Reason::DISK_FULL, "12 MiB of 100000 MiB free"};
  now.status.lcm = {Reason::NO_MULTICAST_ROUTE, "no route"};
  now.status.connections = {Reason::TOO_MANY_FILES, "160 files may be open"};
  now.status.access = {Reason::BAD_CONFIG, "line 13"};
  now.status.certificate = {Reason::BAD_CONFIG, "server.pem expires"};
  now.status.doubtful_cameras = {{7, "car", "monday", {2, 5}, 41, "it fits a focal length 10 % longer"}};
  now.status.places_left_out = 12;
  now.status.memory_shares[5].used = 64 << 20;  // queues
  now.status.memory_shares[1].used = 64 << 20;  // a full cache is a good one
  now.robots = {robot("a-well"), robot("b-silent"), robot("c-twice")};
  now.robots[1].silent = true;
  now.robots[1].silent_s = 300;
  now.robots[2].same_name = {"99999999-2222-3333-4444-555555555555"};
  const std::string text = shown(now);
  EXPECT_THAT(text, StartsWith("needs attention\n"));
  std::size_t last = 0;
  for (const char* line : {"  storage ", "  lcm ", "  connections ", "  access list ", "  certificate ",
                           "  robot c-twice ", "  session 7 ", "  places ", "  memory ", "  robot b-silent "}) {
    const std::size_t at = text.find(line);
    ASSERT_NE(at, std::string::npos) << line << text;
    EXPECT_GT(at, last) << line;
    last = at;
  }
  const std::size_t advice = text.find(
      "\nrelmap-admin explain DISK_FULL NO_MULTICAST_ROUTE TOO_MANY_FILES BAD_CONFIG WRONG_CALIBRATION tells what to "
      "do\n");
  EXPECT_LT(last, advice) << text;
  EXPECT_LT(advice, text.find("daemon "));
  EXPECT_THAT(text, HasSubstr("DISK_FULL: 12 MiB of 100000 MiB free"));
  EXPECT_THAT(text, HasSubstr("SAME_NAME: another robot sends under the same name, for session 99999999-"));
  EXPECT_THAT(
      text,
      HasSubstr("car, monday: its camera's calibration is in doubt: 41 keyframes contradict it (against sessions"));
  EXPECT_THAT(text, HasSubstr("it fits a focal length 10 % longer. Calibrate"));
  EXPECT_THAT(text, HasSubstr("silent: not heard of for 5 min 00 s, and its session has not ended"));
  EXPECT_THAT(text, HasSubstr("queues hold 67.1 MB of 67.1 MB: robots are told to wait"));
  EXPECT_THAT(text, Not(HasSubstr("robot a-well")));
  EXPECT_THAT(text, HasSubstr("2 heard of in the last minute, 1 silent since"));
}

TEST(StatusView, ARobotWithoutANameIsNamedByItsSession) {
  StatusMoment now = moment();
  client::RobotStatus robot;
  robot.uuid = "0f1e2d3c-4b5a-4677-8899-aabbccddeeff";
  robot.refused[Reason::CORRUPT] = 2;
  now.robots = {robot};
  EXPECT_THAT(shown(now), HasSubstr("robot of session 0f1e2d3c  not begun: all that it sent was refused: CORRUPT, its "
                                    "bytes are damaged, or are no keyframe"));
}

TEST(StatusView, OfManyRobotsInTroubleSomeAreNamed) {
  StatusMoment now = moment();
  for (int i = 0; i < 50; ++i) {
    now.robots.push_back(robot("cart-" + std::to_string(i)));
    now.robots.back().blocked = Reason::DISK_FULL;
  }
  const std::string text = shown(now);
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 28);
  EXPECT_THAT(text, HasSubstr("46 more in trouble: relmap top names them"));
}

}  // namespace
}  // namespace relmap::cli
