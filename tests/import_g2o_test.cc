// relmap import g2o: a graph becomes a session whose loops are judged; importing it again changes nothing, also after
// the daemon was killed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {
namespace {

constexpr int kLap = 800, kFrames = 1200;  // several pieces
constexpr double kRadius = 50;

// One and a half times round a circle; loops between the laps, and one that is false.
void write_graph(const std::string& path) {
  std::ofstream file(path);
  file.precision(12);
  const double turn = 2 * std::numbers::pi / kLap, step = 2 * kRadius * std::sin(turn / 2);
  for (int i = 0; i < kFrames; ++i)
    file << "VERTEX_SE2 " << i << ' ' << kRadius * std::sin(turn * i) << ' ' << kRadius * (1 - std::cos(turn * i))
         << ' ' << turn * i << '\n';
  for (int i = 1; i < kFrames; ++i)
    file << "EDGE_SE2 " << i - 1 << ' ' << i << ' ' << step * std::cos(turn / 2) << ' ' << step * std::sin(turn / 2)
         << ' ' << turn << " 2500 0 0 2500 0 1e6\n";
  for (int i = kLap; i < kFrames; i += 50) file << "EDGE_SE2 " << i << ' ' << i - kLap << " 0 0 0 100 0 0 100 0 1000\n";
  file << "EDGE_SE2 100 40 0 0 0 100 0 0 100 0 1000\n"  // 60 steps before, it says: the same place
       << "EDGE_SE2 40 100 0 0 0 100 0 0 100 0 1000\n"  // once more
       << "EDGE_SE2 7 7 0 0 0 1 0 0 1 0 1\nFIX 0\n";
}

TEST(ImportG2o, AGraphBecomesASessionWhoseLoopsAreJudged) {
  const storage::TemporaryFolder folder;
  write_graph(folder / "circle.g2o");
  const DaemonOptions options{.data = folder / "map", .lcm = {}, .more = {}};
  auto daemon = std::make_unique<RunningDaemon>(options);
  const auto import = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{built_program("relmap"), "--server", folder / "map"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments, std::chrono::minutes(2));
  };

  const Finished done = import({"import", "g2o", folder / "circle.g2o"});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  EXPECT_NE(done.standard_error.find("1 edges from a frame to itself are refused (INVALID_ARGUMENT): line "),
            std::string::npos)
      << done.standard_error;
  EXPECT_NE(done.standard_error.find("1 line of FIX left out"), std::string::npos) << done.standard_error;
  EXPECT_NE(done.standard_output.find("9 proposed, 1 more between the same frames left out"), std::string::npos)
      << done.standard_output;
  EXPECT_NE(done.standard_error.find("1 loops between frames that have one already are left out: line "),
            std::string::npos)
      << done.standard_error;

  const auto accepted = [&] {
    client::EdgeFilter loops;
    loops.kinds = {client::EdgeKind::kLoop};
    std::size_t count = 0;
    const auto edges = daemon->client()->edges(loops).or_throw();
    for (const client::Edge& edge : edges) {
      const bool taken_in = edge.state == client::EdgeState::kAccepted;
      EXPECT_EQ(taken_in, edge.b.index >= kLap) << edge.id.to_string();
      EXPECT_EQ(edge.verification, client::Verification::kImported);
      count += taken_in;
    }
    return count;
  };
  EXPECT_EQ(accepted(), 8u);
  EXPECT_LE(daemon->client()->transform_between({1, 0}, {1, kLap + 10}).or_throw().edges, 20u);

  // The first of two agreeing loops waited for the second; the false one is distinguished from both.
  const std::string first = EdgeId{{1, kLap}, 1}.to_string(), wrong = EdgeId{{1, 100}, 1}.to_string();
  const Finished why = import({"edges", "--explain", first});
  EXPECT_EQ(why.exit_code, 0) << why.standard_error;
  for (const std::string& part :
       {first + ": loop 1:0 -> 1:" + std::to_string(kLap) +
            ", accepted, CONSISTENT (closures of neighbouring frames agree with it)",
        std::string("evidence  imported with session 1, circle.g2o, of robot imported; not verified here; binds 0"),
        std::string("closures of other frames\n    accepted "),
        std::string(": candidate, LONE (no other closure agrees with it yet)"), std::string(": accepted, CONSISTENT")})
    EXPECT_NE(why.standard_output.find(part), std::string::npos) << part << '\n' << why.standard_output;
  const Finished why_not = import({"edges", "--explain", wrong});
  EXPECT_NE(why_not.standard_output.find("CONTRADICTS_MOTION (the robot's own motion contradicts it)"),
            std::string::npos)
      << why_not.standard_output;
  EXPECT_NE(why_not.standard_output.find("carries   nothing: it is not in force"), std::string::npos);
  EXPECT_NE(import({"edges", "--explain", "1:5/9"}).standard_error.find("NO_SUCH_EDGE"), std::string::npos);

  daemon->process().kill();
  daemon.reset();
  daemon = std::make_unique<RunningDaemon>(options);
  const Finished again = import({"--json", "import", "g2o", folder / "circle.g2o"});
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  EXPECT_TRUE(
      again.standard_output.starts_with(R"({"graph":{"frames":1200,"loops":9,"parallelLoops":1,"selfEdges":1}})"))
      << again.standard_output.substr(0, 200);
  const auto sessions = daemon->client()->sessions().or_throw();
  ASSERT_EQ(sessions.size(), 1u);
  EXPECT_EQ(sessions[0].frames, kFrames);
  EXPECT_EQ(sessions[0].name, "circle.g2o");
  EXPECT_EQ(accepted(), 8u);

  EXPECT_EQ(import({"import", "g2o", folder / "nothing.g2o"}).exit_code, 1);
  EXPECT_EQ(import({"import", "g2o"}).exit_code, 2);
}

TEST(ImportG2o, ARouteAlongAnUnmeasuredStepIsReportedAsAGuessFirst) {
  const storage::TemporaryFolder folder;
  {
    std::ofstream file(folder / "line.g2o");
    for (int i = 0; i < 10; ++i) file << "VERTEX_SE2 " << i << ' ' << i << " 0 0\n";
    for (int i = 1; i < 10; ++i)
      if (i != 5) file << "EDGE_SE2 " << i - 1 << ' ' << i << " 1 0 0 2500 0 0 2500 0 1e6\n";
  }
  const RunningDaemon daemon({.data = folder / "map", .lcm = {}, .more = {}});
  const auto relmap = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", folder / "map"});
    const Finished done = run_program(arguments, std::chrono::minutes(1));
    EXPECT_EQ(done.exit_code, 0) << done.standard_error;
    return done.standard_output;
  };
  relmap({"import", "g2o", folder / "line.g2o"});
  const auto said = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  const std::string guess = "a guess along 1 step that nothing measured, 1.00 of 9.00 m: frames 1:4..1:5\n";
  for (const std::vector<std::string>& way :
       {std::vector<std::string>{"transform", "1:0", "1:9"}, {"route", "--from", "1:9", "--to", "1:0"}}) {
    const std::string answer = relmap(way);
    EXPECT_TRUE(answer.starts_with("not measured")) << answer;
    EXPECT_TRUE(said(answer, guess)) << answer;
    std::vector<std::string> as_json = way;
    as_json.insert(as_json.begin(), "--json");
    EXPECT_TRUE(said(relmap(as_json), R"("unmeasuredSteps":1)")) << relmap(as_json);
  }
  EXPECT_TRUE(said(relmap({"route", "--from", "1:3", "--to", "1:6", "--steps"}), ", not measured"));
  EXPECT_FALSE(said(relmap({"transform", "1:0", "1:4"}), "not measured"));
  EXPECT_FALSE(said(relmap({"route", "--from", "1:5", "--to", "1:9"}), "not measured"));
}

}  // namespace
}  // namespace relmap::testing
