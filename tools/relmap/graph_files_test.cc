#include "tools/relmap/graph_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tools/g2o/pose_graph.h"

namespace relmap::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

client::Edge edge(FrameId a, FrameId b, const Vector3& t, double turn, client::EdgeKind kind) {
  client::Edge made;
  made.id = {b, kind == client::EdgeKind::kLoop ? 1u : 0u};
  made.a = a;
  made.b = b;
  made.kind = kind;
  made.state = client::EdgeState::kAccepted;
  made.carries = true;
  Vector6 xi;
  xi << t, 0, turn, 0;
  made.T_ab = SE3::exp(xi);
  made.covariance = 1e-4 * Matrix6::Identity();
  made.covariance(0, 4) = made.covariance(4, 0) = 2e-5;
  return made;
}

// A session of four frames round a square, one alone, a step that nothing measured, and a closure that is `off` metres
// wrong.
MapGraph square(double off) {
  MapGraph graph;
  graph.names = {{1, "round \"the\" square"}, {4, "alone"}};
  for (std::uint32_t i = 0; i < 5; ++i) graph.frames.insert({1, i});
  graph.frames.insert({4, 7});
  for (std::uint32_t i = 0; i < 4; ++i)
    graph.edges.push_back(edge({1, i}, {1, i + 1}, {0, 0, 2}, M_PI / 2, client::EdgeKind::kOdometry));
  SE3 T_first_last;
  for (const client::Edge& step : graph.edges) T_first_last = T_first_last * step.T_ab;
  graph.edges.push_back(edge({1, 0}, {1, 4}, {0, 0, 0}, 0, client::EdgeKind::kLoop));
  graph.edges.back().T_ab = T_first_last;
  graph.edges.back().T_ab.t.x() += off;
  client::Edge guess = edge({1, 4}, {1, 5}, {0, 0, 1}, 0, client::EdgeKind::kPrior);
  guess.unmeasured = true;
  guess.source = MotionSource::kConstantVelocity;
  graph.frames.insert({1, 5});
  graph.edges.push_back(guess);
  client::Edge candidate = edge({1, 0}, {1, 2}, {9, 9, 9}, 0, client::EdgeKind::kLoop);
  candidate.state = client::EdgeState::kCandidate;
  graph.edges.push_back(candidate);
  return graph;
}

const std::vector<client::LabelledFrames> kLabels{{"dock", {{1, 2}}}, {"elsewhere", {{9, 9}}}};

RelaxedMap relaxed(double off, std::optional<FrameId> root = {}) {
  return relax_map(square(off), kLabels, root).or_throw();
}

template <typename Write>
std::string written(const Write& write) {
  std::ostringstream out;
  write(out);
  return out.str();
}
std::string g2o(const RelaxedMap& map, std::size_t part) {
  return written([&](std::ostream& out) { write_g2o(map, part, out); });
}
std::string ply(const RelaxedMap& map, std::size_t part, const std::string& landmarks = "", std::uint64_t count = 0) {
  return written([&](std::ostream& out) {
    write_ply_head(map, part, count, out);
    out << landmarks;
    write_ply_tail(map, part, out);
  });
}
std::string geojson(const RelaxedMap& map, std::size_t part, const std::optional<Geodetic>& place = {}) {
  return written([&](std::ostream& out) { write_geojson(map, part, place, out); });
}
FrameTimes all_times(const RelaxedMap& map) {
  FrameTimes times;
  for (const FrameId frame : map.graph.frames) times[frame] = 1'700'000'000'000'000 + frame.index * 100'000;
  return times;
}
std::string tum(const RelaxedMap& map, std::size_t part) {
  return written([&](std::ostream& out) { write_tum(map, part, all_times(map), out); });
}

std::vector<std::vector<double>> rows_of(const std::string& text) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream numbers(line);
    rows.emplace_back();
    for (double number = 0; numbers >> number;) rows.back().push_back(number);
  }
  return rows;
}

TEST(GraphFiles, TumIsTheRelaxedGraphInTheFrameOfItsRoot) {
  const RelaxedMap map = relaxed(0, FrameId{1, 2});
  const std::string text = tum(map, 0);
  EXPECT_THAT(text, HasSubstr("part 1 of 2. The parts are not connected"));
  EXPECT_THAT(text, HasSubstr("# root 1:2 (round \"the\" square)"));
  EXPECT_THAT(text, HasSubstr("# session 1 (round \"the\" square): time"));
  EXPECT_THAT(text, HasSubstr("# not measured: 1:4 to 1:5: constant velocity"));
  EXPECT_THAT(text, HasSubstr("\n1700000000.200000 0 0 0 0 0 0 1\n")) << "the root";
  const auto rows = rows_of(text);
  ASSERT_EQ(rows.size(), 6u);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 8u);
    const SE3& pose = map.parts[0].frames[i].T_root_frame;
    EXPECT_LT((Vector3(rows[i][1], rows[i][2], rows[i][3]) - pose.t).norm(), 1e-6);
    const Eigen::Quaterniond q(rows[i][7], rows[i][4], rows[i][5], rows[i][6]);
    EXPECT_LT((q.toRotationMatrix() - pose.R).norm(), 1e-6);
  }
  EXPECT_THAT(tum(map, 1), HasSubstr("# root 4:7 (alone)"));
  EXPECT_EQ(rows_of(tum(map, 1)).size(), 1u) << "a part has nothing of the others";

  FrameTimes times = all_times(map);
  times.erase({1, 3});
  std::ostringstream out;
  EXPECT_EQ(write_tum(map, 0, times, out), 1u);
  EXPECT_EQ(rows_of(out.str()).size(), 5u);
}

TEST(GraphFiles, KittiHasTheSamePosesAndNoComments) {
  const RelaxedMap map = relaxed(0);
  const std::string text = written([&](std::ostream& out) { write_kitti(map.parts[0], out); });
  EXPECT_THAT(text, Not(HasSubstr("#")));
  const auto rows = rows_of(text);
  ASSERT_EQ(rows.size(), 6u);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 12u);
    const SE3& pose = map.parts[0].frames[i].T_root_frame;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(rows[i][static_cast<std::size_t>(4 * r + c)], pose.R(r, c), 1e-7);
      EXPECT_NEAR(rows[i][static_cast<std::size_t>(4 * r + 3)], pose.t(r), 1e-7);
    }
  }
  EXPECT_THAT(numbering(map.parts[0], 1), ::testing::ElementsAre("1 to 6: frames 1:0 to 1:5"));
}

TEST(GraphFiles, G2oCanBeReadBack) {
  const RelaxedMap map = relaxed(0);
  EXPECT_EQ(map.parts[0].tears.size(), 0u);
  const std::string text = g2o(map, 0);
  EXPECT_THAT(text, HasSubstr("# root 1:0"));
  EXPECT_THAT(text, HasSubstr("# vertices 0 to 5: frames 1:0 to 1:5"));
  EXPECT_THAT(text, HasSubstr("FIX 0\n"));
  EXPECT_THAT(g2o(map, 1), HasSubstr("# vertices 0 to 0: frames 4:7 to 4:7"));
  const g2o::PoseGraph read = g2o::parse_pose_graph(text, "map.g2o").or_throw();
  ASSERT_EQ(read.poses.size(), 6u);
  ASSERT_EQ(read.odometry.size(), 5u);
  ASSERT_EQ(read.loops.size(), 1u) << "the candidate is no edge of the graph";
  for (std::size_t i = 0; i < 4; ++i) {
    const client::Edge& wrote = map.graph.edges[i];
    EXPECT_LT((read.odometry[i].T_ab.t - wrote.T_ab.t).norm(), 1e-9);
    EXPECT_LT((read.odometry[i].T_ab.R - wrote.T_ab.R).norm(), 1e-9);
    EXPECT_LT((read.odometry[i].covariance - wrote.covariance).norm(), 1e-9);
    EXPECT_LT((read.poses[i].t - map.parts[0].frames[i].T_root_frame.t).norm(), 1e-9);
  }
  EXPECT_THAT(g2o(relaxed(0, FrameId{1, 3}), 0), HasSubstr("FIX 3\n"));
}

TEST(GraphFiles, TearsAndGuessesAreListedInEachFormatWithComments) {
  const RelaxedMap map = relaxed(3);
  ASSERT_GE(map.parts[0].tears.size(), 1u);
  EXPECT_GT(map.parts[0].tears[0].sigmas, client::kTearSigmas);
  const std::string id = map.parts[0].tears[0].edge.to_string();
  EXPECT_THAT(tum(map, 0), HasSubstr("# tear " + id));
  EXPECT_THAT(g2o(map, 0), HasSubstr("# tear " + id));
  EXPECT_THAT(ply(map, 0), HasSubstr("comment tear " + id));
  EXPECT_THAT(geojson(map, 0), HasSubstr("\"tears\":[{\"edge\":\"" + id));
  const std::string guess = "not measured: 1:4 to 1:5: constant velocity, sigma 0.01 m";
  EXPECT_THAT(g2o(map, 0), HasSubstr("# " + guess));
  EXPECT_THAT(ply(map, 0), HasSubstr("comment " + guess));
  EXPECT_THAT(geojson(map, 0), HasSubstr("\"doubtful\":[{\"edge\":\"1:5/0\",\"guess\":\"constant velocity\""));
  EXPECT_THAT(g2o(map, 1), Not(HasSubstr("tear"))) << "the other part's";
}

TEST(GraphFiles, ASessionsNameCannotBreakALine) {
  MapGraph graph = square(0);
  graph.names[1] = "two\nlines\r";
  const RelaxedMap map = relax_map(std::move(graph), {}).or_throw();
  EXPECT_THAT(tum(map, 0), HasSubstr("# root 1:0 (two lines )"));
  EXPECT_THAT(geojson(map, 0), HasSubstr("two\\nlines"));
}

TEST(GraphFiles, PlyHoldsWhatItsHeaderSaysFramesFirst) {
  const RelaxedMap map = relaxed(0);
  const SE3& base = *map.parts[0].find({1, 2});
  const client::ExportedFrame::Landmark landmark{{1, 2, 3}, 5};
  std::istringstream lines(ply(map, 0, ply_landmark({1, 2}, base, landmark), 1));
  std::string line;
  std::size_t vertices = 0, edges = 0;
  ASSERT_TRUE(std::getline(lines, line) && line == "ply");
  while (std::getline(lines, line) && line != "end_header") {
    if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
    if (line.starts_with("element edge ")) edges = std::stoul(line.substr(13));
  }
  EXPECT_EQ(vertices, 7u);
  EXPECT_EQ(edges, 6u);
  std::vector<std::vector<double>> rows;
  for (; std::getline(lines, line);) {
    std::istringstream words(line);
    rows.emplace_back();
    for (double word = 0; words >> word;) rows.back().push_back(word);
    EXPECT_EQ(rows.back().size(), rows.size() <= vertices ? 9u : 4u) << line;
  }
  ASSERT_EQ(rows.size(), vertices + edges);
  EXPECT_EQ(rows[2][7], 2);
  EXPECT_EQ(rows[2][8], 0) << "a frame";
  EXPECT_LT((Vector3(rows[6][0], rows[6][1], rows[6][2]) - base * Vector3(1, 2, 3)).norm(), 1e-5);
  EXPECT_EQ(rows[6][7], 2) << "the frame that it is stored in";
  EXPECT_EQ(rows[6][8], 5);
  EXPECT_EQ(std::count_if(rows.begin() + 7, rows.end(), [](const auto& row) { return row[3] == 1; }), 1) << "the guess";
}

TEST(GraphFiles, GeojsonWithoutAPlaceOnTheEarthHasNoCoordinates) {
  const RelaxedMap map = relaxed(0);
  for (const std::string& text : {geojson(map, 0), geojson(map, 1)}) {
    EXPECT_THAT(text, Not(HasSubstr("\"coordinates\""))) << "those of GeoJSON are longitude and latitude";
    EXPECT_THAT(text, HasSubstr("\"geometry\":null"));
    EXPECT_THAT(text, HasSubstr("\"located\":false"));
  }
  EXPECT_THAT(geojson(map, 1), HasSubstr("\"metresInRoot\":[[0.0000,0.0000,0.0000]]"));
}

TEST(GraphFiles, GeojsonIsLocatedByItsRoot) {
  const RelaxedMap map = relaxed(0);
  // The root looks east: the second frame, 2 m before it, is 2 m to the east.
  const std::string text = geojson(map, 0, Geodetic{51.5, -0.12, 90, {}});
  EXPECT_THAT(text, HasSubstr("\"root\":\"1:0\""));
  EXPECT_THAT(text, HasSubstr("\"name\":\"round \\\"the\\\" square\""));
  EXPECT_THAT(text, HasSubstr("\"label\":\"dock\",\"frame\":\"1:2\""));
  EXPECT_THAT(text, Not(HasSubstr("elsewhere"))) << "a label of a frame that is not there";
  EXPECT_THAT(text, Not(HasSubstr("alone"))) << "how it lies to the root is not known";
  const std::size_t line = text.find("[[");
  ASSERT_NE(line, std::string::npos);
  double longitude[2], latitude[2];
  ASSERT_EQ(std::sscanf(text.c_str() + line, "[[%lf,%lf],[%lf,%lf]", &longitude[0], &latitude[0], &longitude[1],
                        &latitude[1]),
            4);
  EXPECT_NEAR(longitude[0], -0.12, 1e-9);
  EXPECT_NEAR(latitude[0], 51.5, 1e-9);
  const Vector3 second = map.parts[0].frames[1].T_root_frame.t;
  const double metres = 111'412 * std::cos(51.5 * M_PI / 180) * (longitude[1] - longitude[0]);
  EXPECT_NEAR(metres, second.z(), 0.01 * std::abs(second.z()));
  EXPECT_NEAR(111'240 * (latitude[1] - latitude[0]), -second.x(), 0.01 * std::abs(second.x()) + 1e-4);

  const std::string high = geojson(map, 0, Geodetic{51.5, -0.12, 90, 35.0});
  EXPECT_THAT(high, HasSubstr("[[-0.120000000,51.500000000,35.000],")) << "a height only where one is known";
}

TEST(GraphFiles, GeojsonDrawsGuessesApartFromWhatWasDriven) {
  const std::string text = geojson(relaxed(0), 0);
  EXPECT_THAT(text, HasSubstr("\"first\":\"1:0\",\"last\":\"1:4\""));
  EXPECT_THAT(text, HasSubstr("\"first\":\"1:5\",\"last\":\"1:5\""));
  EXPECT_THAT(text, HasSubstr("\"edge\":\"1:5/0\",\"kind\":\"prior\",\"tear\":false,\"doubtful\":true"));
  EXPECT_THAT(text, HasSubstr("\"kind\":\"loop\",\"tear\":false,\"doubtful\":false"));
}

}  // namespace
}  // namespace relmap::cli
