// Twenty robots over a network that loses, delays and doubles, into one daemon: nothing is lost, nothing is there
// twice, and what a robot sent is soon acknowledged; though daemon and robots are killed, though others make trouble.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/bench_figures.h"

namespace relmap::testing {
namespace {

BenchFigures fleet(double seconds, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments{"fleet", "--batch", "0", "--seconds", std::to_string(seconds)};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return BenchFigures(arguments, std::chrono::seconds(std::max(110L, std::lround(2 * seconds))));
}

void expect_all_there_once(const BenchFigures& figures, double at_least) {
  EXPECT_GE(figures["sent"], at_least) << "no test of much";
  EXPECT_EQ(figures["acknowledged"], figures["sent"]);
  EXPECT_EQ(figures["lost"], 0);
  EXPECT_EQ(figures["doubled"], 0);
  EXPECT_EQ(figures["strange"], 0);
  EXPECT_EQ(figures["refused"], 0);
  EXPECT_EQ(figures["given_up"], 0);
}

constexpr double kAcknowledgedMs = 500;  // the 99th of a hundred

TEST(Fleet, LosesNothingOverABadNetwork) {
  const BenchFigures figures = fleet(30);
  expect_all_there_once(figures, 20 * 5 * 30 * 0.9);
  EXPECT_LE(figures["ack_p99_ms"], kAcknowledgedMs);
  EXPECT_GT(figures["resent_share"], 0.03) << "the network was not bad";
  EXPECT_GT(figures["closures"], 0) << "the map had nothing to do";
  EXPECT_LE(figures["cpu_percent"], 200);
  EXPECT_LE(figures["daemon_resident_mb"], figures["memory_budget_mb"]);
}

TEST(Fleet, LosesNothingThoughDaemonAndRobotsAreKilled) {
  const BenchFigures figures = fleet(20, {"--kill-daemon", "3", "--kill-robots", "5", "--kills-each", "2"});
  expect_all_there_once(figures, 20 * 5 * 20 * 0.8);
  const std::vector<double> daemon = figures.series("settled_after_restart_s");
  EXPECT_EQ(daemon.size(), 3u);
  for (const double seconds : daemon) EXPECT_LE(seconds, 5);
  const std::vector<double> robots = figures.series("settled_after_robot_restart_s");
  EXPECT_EQ(robots.size(), 10u);
  for (const double seconds : robots) EXPECT_LE(seconds, 5);
}

TEST(LongFleet, LosesNothingInFiveMinutesThoughDaemonAndRobotsAreKilled) {
  const BenchFigures figures = fleet(300, {"--kill-daemon", "10", "--kill-robots", "10", "--kills-each", "3"});
  expect_all_there_once(figures, 20 * 5 * 300 * 0.8);
  EXPECT_EQ(figures.series("settled_after_restart_s").size(), 10u);
  EXPECT_EQ(figures.series("settled_after_robot_restart_s").size(), 30u);
  EXPECT_GT(figures["closures"], 0) << "the map had nothing to do";
  EXPECT_LE(figures["daemon_resident_mb"], figures["memory_budget_mb"]);
}

TEST(Fleet, WhoFloodsOrSendsGarbageHurtsNobodyElse) {
  const BenchFigures quiet = fleet(8);
  const BenchFigures figures = fleet(8, {"--flood", "100", "--garbage", "200"});
  expect_all_there_once(figures, 20 * 5 * 8 * 0.9);
  EXPECT_LE(figures["ack_p99_ms"], kAcknowledgedMs);
  EXPECT_LE(figures["ack_p99_ms"], 2 * quiet["ack_p99_ms"]);
}

}  // namespace
}  // namespace relmap::testing
