#include "server/monitor/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "server/rpc/log_level.h"
#include "server/rpc/request_context.h"

namespace relmap::monitor {
namespace {

using ::testing::MatchesRegex;

class LogTest : public ::testing::Test {
 protected:
  ~LogTest() override {
    unsetenv("JOURNAL_STREAM");
    rpc::set_log_level("info");
    set_up_log("text");
  }
  // What is written to standard error meanwhile, line by line.
  static std::vector<std::string> lines_of(const std::string& format, const std::function<void()>& work) {
    ::testing::internal::CaptureStderr();
    set_up_log(format);
    work();
    spdlog::default_logger()->flush();
    std::istringstream text(::testing::internal::GetCapturedStderr());
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }
  static void log_something() {
    spdlog::info("robot {} has\nconnected\x1b[31m", "cart");
    const rpc::RequestContext request{"id-7", "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"};
    const rpc::RequestScope scope(request);
    spdlog::error("Map.GetFrame: \"INTERNAL\"");
  }
};

TEST_F(LogTest, TextHasOneLineForAnEventWhateverItSays) {
  const auto lines = lines_of("text", log_something);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_THAT(lines[0], MatchesRegex("\\[20[^]]*\\] \\[relmapd\\] \\[info\\] robot cart has.nconnected.x1b\\[31m"));
  EXPECT_THAT(lines[1], MatchesRegex("\\[20[^]]*\\] \\[relmapd\\] \\[error\\] \\[id-7\\] Map.GetFrame: \"INTERNAL\""));
}

TEST_F(LogTest, JsonHasTheRequestAndItsTrace) {
  const auto lines = lines_of("json", log_something);
  ASSERT_EQ(lines.size(), 2u);
  const auto first = nlohmann::json::parse(lines[0]), second = nlohmann::json::parse(lines[1]);
  EXPECT_EQ(first.at("level"), "info");
  EXPECT_EQ(first.at("message"), "robot cart has\nconnected\x1b[31m");
  EXPECT_THAT(first.at("time").get<std::string>(), MatchesRegex("20..-..-..T..:..:..\\....Z"));
  EXPECT_FALSE(first.contains("request_id"));
  EXPECT_EQ(second.at("level"), "error");
  EXPECT_EQ(second.at("request_id"), "id-7");
  EXPECT_EQ(second.at("trace_id"), "4bf92f3577b34da6a3ce929d0e0e4736");
}

TEST_F(LogTest, TheJournalGetsPriorities) {
  const auto lines = lines_of("journal", [] {
    rpc::set_log_level("debug");
    spdlog::debug("d");
    spdlog::info("i");
    spdlog::warn("w");
    spdlog::error("e");
    spdlog::critical("c");
  });
  EXPECT_EQ(lines, (std::vector<std::string>{"<7>d", "<6>i", "<4>w", "<3>e", "<2>c"}));
}

TEST_F(LogTest, TheJournalIsKnownByTheStreamThatSystemdNames) {
  struct stat file {};
  const auto log = [&](bool same) {
    return lines_of("auto", [&] {
      ASSERT_EQ(fstat(STDERR_FILENO, &file), 0);  // as it is while it is captured
      setenv("JOURNAL_STREAM", (std::to_string(file.st_dev) + ":" + std::to_string(file.st_ino + !same)).c_str(), 1);
      set_up_log("auto");
      spdlog::info("one");
    });
  };
  EXPECT_EQ(log(true), (std::vector<std::string>{"<6>one"}));
  EXPECT_THAT(log(false).at(0), MatchesRegex("\\[.*\\] one")) << "standard error was sent elsewhere";
}

TEST_F(LogTest, CountsWhatIsWrong) {
  const LogCounts before = log_counts();
  lines_of("text", [] {
    spdlog::info("i");
    spdlog::warn("w");
    spdlog::error("e");
    spdlog::error("e");
    spdlog::critical("c");
  });
  EXPECT_EQ(log_counts().warnings, before.warnings + 1);
  EXPECT_EQ(log_counts().errors, before.errors + 2);
  EXPECT_EQ(log_counts().criticals, before.criticals + 1);
}

TEST_F(LogTest, LevelsAreNamed) {
  for (const std::string& level : rpc::log_levels()) {
    EXPECT_TRUE(rpc::set_log_level(level));
    EXPECT_EQ(rpc::log_level(), level);
  }
  EXPECT_FALSE(rpc::set_log_level("loud"));
  EXPECT_EQ(rpc::log_level(), "error") << "as it was";
}

}  // namespace
}  // namespace relmap::monitor
