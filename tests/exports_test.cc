// relmap export and relmap map on a map of three unconnected parts: a drive that closes its loop, and an imported graph
// with one step that nothing measured.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "proto/base/number_text.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr int kDriven = 120;                   // frames of session 1
constexpr int kGraph = 40, kUnknownStep = 25;  // frames of session 2; from the one before this nothing leads to it

class Exports : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    daemon_ = std::make_unique<RunningDaemon>(DaemonOptions{.data = folder_ / "map", .lcm = {}, .more = {}});
    const Finished made = run_program({built_program("relmap-sim"), "points", "--out", folder_ / "drive", "--frames",
                                       std::to_string(kDriven), "--frames-per-lap", "100", "--appearance", "100"});
    ASSERT_EQ(made.exit_code, 0) << made.standard_error;
    const Finished ingested = relmap({"ingest", folder_ / "drive"});
    ASSERT_EQ(ingested.exit_code, 0) << ingested.standard_error;
    write_graph();
    const Finished imported = relmap({"import", "g2o", folder_ / "graph.g2o"});
    ASSERT_EQ(imported.exit_code, 0) << imported.standard_error;
    ASSERT_TRUE(daemon_->client()->wait_idle().ok());
  }

  void write_graph() const {
    std::ofstream file(folder_ / "graph.g2o");
    for (int i = 0; i < kGraph; ++i) file << "VERTEX_SE2 " << i << ' ' << i << " 0 0\n";
    for (int i = 1; i < kGraph; ++i)
      if (i != kUnknownStep) file << "EDGE_SE2 " << i - 1 << ' ' << i << " 1 0 0 2500 0 0 2500 0 1e6\n";
  }

  // Four, to be taken for photographs.
  void render_pictures() const {
    const Finished made = run_program({built_program("relmap-sim"), "pictures", "--out", folder_ / "pictures",
                                       "--pairs", "4", "--laps", "0.03", "--width", "320"});
    ASSERT_EQ(made.exit_code, 0) << made.standard_error;
  }

  Finished relmap(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", folder_ / "map"});
    return run_program(arguments);
  }
  // What is in the folder of exports, after an export into it.
  std::vector<std::string> exported(std::vector<std::string> arguments) {
    std::filesystem::remove_all(folder_ / "out");
    std::filesystem::create_directory(folder_ / "out");
    arguments.insert(arguments.begin(), "export");
    last_ = relmap(arguments);
    EXPECT_EQ(last_.exit_code, 0) << last_.standard_error;
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "out"))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  std::string out(const std::string& name) const { return read_text(folder_ / ("out/" + name)); }

  static std::vector<std::string> data_lines(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
      if (!line.starts_with('#')) lines.push_back(line);
    return lines;
  }

  const storage::TemporaryFolder folder_;
  std::unique_ptr<RunningDaemon> daemon_;
  Finished last_;
};

using ::testing::ElementsAre;

TEST_F(Exports, PartsThatNothingConnectsAreFilesOfTheirOwn) {
  EXPECT_THAT(exported({"--out", folder_ / "out/map.tum"}), ElementsAre("map.2-0.tum", "map.2-25.tum", "map.tum"));
  EXPECT_EQ(last_.standard_output, "");
  EXPECT_EQ(data_lines(out("map.tum")).size(), kDriven);
  EXPECT_EQ(data_lines(out("map.2-0.tum")).size(), kUnknownStep);
  EXPECT_EQ(data_lines(out("map.2-25.tum")).size(), kGraph - kUnknownStep);
  // File and stderr agree on the root.
  for (const auto& [file, root] :
       {std::pair("map.tum", "1:0"), std::pair("map.2-0.tum", "2:0"), std::pair("map.2-25.tum", "2:25")}) {
    EXPECT_THAT(out(file), HasSubstr(std::string("\n# root ") + root + " (")) << file;
    const std::size_t line = last_.standard_error.find(std::string(file) + ": part ");
    ASSERT_NE(line, std::string::npos) << last_.standard_error;
    EXPECT_THAT(last_.standard_error.substr(line, last_.standard_error.find('\n', line) - line),
                HasSubstr(std::string(" in the frame of ") + root + " ("));
  }
  EXPECT_THAT(out("map.tum"), HasSubstr("part 1 of 3. The parts are not connected"));
  EXPECT_THAT(last_.standard_error, HasSubstr("The parts are not connected"));
  // The unknown step is not exported as a step of 0 or 1 m, but reported.
  for (const char* file : {"map.2-0.tum", "map.2-25.tum"})
    EXPECT_THAT(out(file), HasSubstr("# not measured: 2:24 to 2:25: unsensed")) << file;
  EXPECT_THAT(last_.standard_error, HasSubstr("not measured: 2:24 to 2:25: unsensed"));
  EXPECT_THAT(out("map.tum"), Not(HasSubstr("not measured")));

  // The pose of a frame is the same in every format.
  EXPECT_THAT(exported({"--format", "kitti", "--out", folder_ / "out/map.txt"}),
              ElementsAre("map.2-0.txt", "map.2-25.txt", "map.txt"));
  EXPECT_EQ(data_lines(out("map.txt")).size(), kDriven);
  EXPECT_THAT(out("map.txt"), Not(HasSubstr("#"))) << "KITTI knows no comments";
  EXPECT_THAT(last_.standard_error, HasSubstr("lines 1 to 120: frames 1:0 to 1:119"));
  EXPECT_THAT(last_.standard_error, HasSubstr("not measured: 2:24 to 2:25"));
}

TEST_F(Exports, StandardOutputTakesOnePartAndSaysWhatItLeavesOut) {
  exported({});
  EXPECT_EQ(data_lines(last_.standard_output).size(), kDriven);
  EXPECT_THAT(last_.standard_error, HasSubstr("left out: part 2 of 3: 25 frames of 1 session in the frame of 2:0"));
  EXPECT_THAT(last_.standard_error, HasSubstr("left out: part 3 of 3: 15 frames of 1 session in the frame of 2:25"));
  EXPECT_THAT(last_.standard_error, HasSubstr("--out FILE"));

  exported({"--root", "2:30", "--out", "-"});
  const std::vector<std::string> lines = data_lines(last_.standard_output);
  ASSERT_EQ(lines.size(), kGraph - kUnknownStep);
  EXPECT_THAT(lines[5], HasSubstr(" 0 0 0 0 0 0 1")) << "the root, whatever comes before it";
  EXPECT_THAT(last_.standard_output, HasSubstr("# root 2:30 ("));
  EXPECT_THAT(last_.standard_error, HasSubstr("in the frame of 2:30"));

  exported({"--session", "2"});
  EXPECT_EQ(data_lines(last_.standard_output).size(), kUnknownStep);
  EXPECT_THAT(last_.standard_error, HasSubstr("part 1 of 2"));

  const Finished nowhere = relmap({"export", "--root", "9:9"});
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_THAT(nowhere.standard_error, StartsWith("NO_SUCH_FRAME: "));
  EXPECT_THAT(relmap({"export", "--session", "nobody"}).standard_error, StartsWith("NO_SUCH_SESSION: "));
}

TEST_F(Exports, AChainIsOfOneSessionWithItsGuessesMarked) {
  EXPECT_THAT(exported({"--chain", "--out", folder_ / "out/chain.tum"}), ElementsAre("chain.2-0.tum", "chain.tum"));
  EXPECT_EQ(data_lines(out("chain.tum")).size(), kDriven);
  const std::string chain = out("chain.2-0.tum");
  EXPECT_EQ(data_lines(chain).size(), kGraph);
  EXPECT_THAT(chain, HasSubstr("\n# not measured: 2:24 to 2:25 (unsensed, sigma "));
  EXPECT_THAT(last_.standard_error, HasSubstr("not measured: 2:24 to 2:25: unsensed"));
  exported({"--chain", "--format", "kitti"});
  EXPECT_EQ(data_lines(last_.standard_output).size(), kDriven) << "one session, not all in one";
  EXPECT_THAT(last_.standard_error, HasSubstr("left out: session 2"));
}

// The motion as refined by the map and the odometry that the robot sent are different things with different names.
TEST_F(Exports, AChainIsNotTheRobotsOwnOdometry) {
  exported({"--chain", "--session", "1"});
  EXPECT_THAT(last_.standard_error, HasSubstr("chained odometry edges of session 1 ("));
  EXPECT_THAT(last_.standard_output, HasSubstr("# chained along the session's odometry edges, as the map has refined"));
  std::istringstream last(data_lines(last_.standard_output).back());
  double time = 0;
  Vector3 chained;
  ASSERT_TRUE(last >> time >> chained.x() >> chained.y() >> chained.z());
  const client::Frame frame = daemon_->client()->frame({1, kDriven - 1}).or_throw();
  EXPECT_GT((chained - frame.T_odom_frame.t).norm(), 1e-3) << "or there is nothing to tell apart";
  const std::string said = relmap({"frame", "1:" + std::to_string(kDriven - 1)}).standard_output;
  EXPECT_THAT(said, HasSubstr("robot's odometry"));
  EXPECT_THAT(said, HasSubstr("as the robot told it"));
  EXPECT_THAT(said, Not(HasSubstr("\nodometry")));
}

TEST_F(Exports, TellsHowManyFramesWereRelaxed) {
  std::filesystem::create_directory(folder_ / "out");
  EXPECT_THAT(relmap({"--json", "export", "--out", folder_ / "out/map.tum"}).standard_output,
              HasSubstr("\"relaxedFrames\":160"));
}

TEST_F(Exports, PlyHasTheLandmarks) {
  EXPECT_THAT(exported({"--format", "ply", "--out", folder_ / "out/map.ply"}),
              ElementsAre("map.2-0.ply", "map.2-25.ply", "map.ply"));
  std::istringstream lines(out("map.ply"));
  std::size_t vertices = 0, edges = 0, rows = 0, landmarks = 0;
  for (std::string line; std::getline(lines, line) && line != "end_header";) {
    if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
    if (line.starts_with("element edge ")) edges = std::stoul(line.substr(13));
  }
  for (std::string line; std::getline(lines, line); ++rows) {
    if (rows >= vertices) continue;
    std::istringstream words(line);
    double x = 0, y = 0, z = 0;
    unsigned red = 0, green = 0, blue = 0, session = 0, index = 0, observers = 0;
    ASSERT_TRUE(words >> x >> y >> z >> red >> green >> blue >> session >> index >> observers) << line;
    EXPECT_EQ(session, 1u);
    EXPECT_EQ(observers > 0, rows >= kDriven);
    landmarks += rows >= kDriven;
    // The drive is a few metres across, and so is what it saw.
    EXPECT_LT(std::abs(x) + std::abs(y) + std::abs(z), 60) << line;
  }
  EXPECT_EQ(rows, vertices + edges);
  EXPECT_EQ(vertices, kDriven + landmarks);
  EXPECT_GT(landmarks, 500u);
  EXPECT_THAT(last_.standard_error, HasSubstr("; " + counted_text(landmarks, "landmark")));
  EXPECT_THAT(out("map.2-0.ply"), HasSubstr("element vertex 25\n"));

  exported({"--format", "ply", "--no-landmarks"});
  EXPECT_THAT(last_.standard_output, HasSubstr("element vertex 120\n"));
  exported({"--format", "ply"});
  EXPECT_THAT(last_.standard_output, HasSubstr("element vertex " + std::to_string(vertices) + "\n"));
}

TEST_F(Exports, GeojsonHasCoordinatesOnlyWhereTheyAreKnown) {
  exported({"--format", "geojson", "--out", folder_ / "out/map.geojson"});
  for (const char* file : {"map.geojson", "map.2-0.geojson", "map.2-25.geojson"})
    EXPECT_THAT(out(file), Not(HasSubstr("\"coordinates\""))) << file;
  EXPECT_THAT(last_.standard_error, HasSubstr("no coordinates on the Earth are known"));

  exported({"--format", "geojson", "--latitude", "51.5", "--longitude", "-0.12", "--heading", "90", "--out",
            folder_ / "out/map.geojson"});
  EXPECT_THAT(out("map.geojson"), HasSubstr("\"coordinates\":[[-0.120000000,51.500000000],"));
  for (const char* file : {"map.2-0.geojson", "map.2-25.geojson"})
    EXPECT_THAT(out(file), Not(HasSubstr("\"coordinates\""))) << file << ": it does not lie by that root";
}

TEST_F(Exports, AScriptReadsWhatWasWritten) {
  std::filesystem::create_directory(folder_ / "out");
  const Finished done = relmap({"--json", "export", "--out", folder_ / "out/map.tum"});
  EXPECT_EQ(done.standard_error, "");
  EXPECT_THAT(done.standard_output, StartsWith("{\"format\":\"tum\",\"files\":[{\"file\":\""));
  EXPECT_THAT(done.standard_output, HasSubstr("\"root\":\"2:25\",\"frames\":15,\"tears\":[],\"doubtful\":[{\"edge\":"
                                              "\"2:25/0\",\"from\":\"2:24\",\"to\":\"2:25\",\"guess\":\"unsensed\""));
  const Finished data = relmap({"--json", "export"});
  EXPECT_EQ(data_lines(data.standard_output).size(), kDriven) << "stdout has the data";
  EXPECT_THAT(data.standard_error, HasSubstr("\"leftOut\":[{\"root\":\"2:0\",\"frames\":25}"));
}

TEST_F(Exports, WrongUsageIsToldAtOnce) {
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--chain", "--format", "ply"},
        {"--chain", "--root", "1:0"},
        {"--latitude", "51", "--longitude", "0", "--format", "geojson"},
        {"--latitude", "51", "--longitude", "0", "--heading", "0", "--format", "tum"},
        {"--altitude", "20", "--format", "geojson"}}) {
    std::vector<std::string> arguments{"export"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const Finished refused = relmap(arguments);
    EXPECT_EQ(refused.exit_code, 2) << ::testing::PrintToString(wrong) << refused.standard_error;
    EXPECT_EQ(refused.standard_output, "");
  }
}

TEST_F(Exports, ThePictureDrawsPartsApart) {
  const Finished drawn = relmap({"map", "--out", folder_ / "map.svg"});
  ASSERT_EQ(drawn.exit_code, 0) << drawn.standard_error;
  EXPECT_THAT(drawn.standard_error, HasSubstr("in 3 parts that nothing connects"));
  const std::string svg = read_text(folder_ / "map.svg");
  for (const char* text : {"3 parts that nothing connects: their position relative to each other is not known",
                           "Part 3 of 3", "15 keyframes in the frame of 2:25", "1 step from part to part"})
    EXPECT_TRUE(svg.find(text) != std::string::npos) << text;
}

// Sessions of photographs have no metres in which they could be drawn.
TEST_F(Exports, PhotographsAreCountedAndNotDrawn) {
  ASSERT_NO_FATAL_FAILURE(render_pictures());
  const auto drawn = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"map", "--out", folder_ / "map.svg"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return relmap(arguments);
  };
  const std::string one = "1 mono session (photographs) has no scale of its own and is not ";
  for (const char* photos : {"cellar", "attic"}) {
    std::filesystem::create_directory(folder_ / photos);
    for (const char* name : {"000000.png", "000002.png"})
      std::filesystem::copy(folder_ / ("pictures/image_0/" + std::string(name)), folder_ / photos);
    const Finished ingested = relmap({"ingest", "--mono", "--robot", "phone", folder_ / photos});
    ASSERT_EQ(ingested.exit_code, 0) << ingested.standard_error;
    const Finished all = drawn({});
    ASSERT_EQ(all.exit_code, 0) << all.standard_error;
    const bool first = std::string(photos) == "cellar";
    EXPECT_THAT(all.standard_error,
                HasSubstr(first ? one + "drawn\n"
                                : "2 mono sessions (photographs) have no scale of their own and are not "
                                  "drawn\n"));
    std::string svg = read_text(folder_ / "map.svg");
    EXPECT_THAT(svg, HasSubstr(first ? ">1 mono session<" : ">2 mono sessions<")) << "the legend, too";
    EXPECT_THAT(svg, HasSubstr("2 sessions, 160 keyframes")) << "those that are drawn";
    exported({});
    EXPECT_THAT(last_.standard_error, HasSubstr(first ? one + "exported\n" : "are not exported\n"));
    exported({"--chain"});
    EXPECT_THAT(last_.standard_error, HasSubstr(first ? one + "exported\n" : "are not exported\n"));
  }
  const Finished chosen = drawn({"--only", "1"});
  EXPECT_EQ(chosen.exit_code, 0) << chosen.standard_error;
  EXPECT_THAT(chosen.standard_error, Not(HasSubstr("photographs"))) << "they were not asked for";
  EXPECT_THAT(drawn({"--only", "3"}).standard_error, StartsWith("NOT_STEREO: "));
}

TEST_F(Exports, AMapOfPhotographsAloneSaysWhyThereIsNothingToDraw) {
  for (const char* session : {"1", "2"}) {
    const Finished deleted = relmap({"session", "delete", session, "--yes"});
    ASSERT_EQ(deleted.exit_code, 0) << deleted.standard_error;
  }
  EXPECT_THAT(relmap({"map", "--out", folder_ / "map.svg"}).standard_error,
              StartsWith("EMPTY_MAP: there is nothing to draw\n"));
  ASSERT_NO_FATAL_FAILURE(render_pictures());
  const Finished ingested = relmap({"ingest", "--mono", "--robot", "phone", folder_ / "pictures/image_0"});
  ASSERT_EQ(ingested.exit_code, 0) << ingested.standard_error;
  EXPECT_THAT(
      relmap({"map", "--out", folder_ / "map.svg"}).standard_error,
      StartsWith("EMPTY_MAP: there is nothing to draw: 1 mono session (photographs) has no scale of its own and is "
                 "not drawn\n"));
}

TEST_F(Exports, APngIsAsWideAsItIsAskedFor) {
  const std::string file = folder_ / "map.png";
  const auto width = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"map", "--out", file};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Finished drawn = relmap(arguments);
    EXPECT_EQ(drawn.exit_code, 0) << drawn.standard_error;
    const std::string header = read_text(file).substr(0, 24);  // IHDR: width and height
    return static_cast<unsigned char>(header.at(18)) * 256 + static_cast<unsigned char>(header.at(19));
  };
  EXPECT_EQ(width({}), 2400);
  EXPECT_EQ(width({"--width", "960"}), 960);
  EXPECT_EQ(relmap({"map", "--out", file, "--width", "5"}).exit_code, 2);
}

}  // namespace
}  // namespace relmap::testing
