#include "tools/relmap/graph_files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tools/g2o/pose_graph.h"

namespace relmap::cli {
namespace {

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

// A session of four frames round a square, one alone, and a closure that is `off` metres wrong.
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
  client::Edge candidate = edge({1, 0}, {1, 2}, {9, 9, 9}, 0, client::EdgeKind::kLoop);
  candidate.state = client::EdgeState::kCandidate;
  graph.edges.push_back(candidate);
  return graph;
}

const std::vector<client::LabelledFrames> kLabels{{"dock", {{1, 2}}}, {"elsewhere", {{9, 9}}}};

TEST(GraphFiles, G2oCanBeReadBack) {
  const RelaxedMap map = relax_map(square(0), kLabels).or_throw();
  EXPECT_EQ(map.tears.size(), 0u);
  EXPECT_EQ(map.roots(), (std::vector<FrameId>{{1, 0}, {4, 7}}));
  const std::string text = to_g2o(map);
  EXPECT_NE(text.find("# root 1:0"), std::string::npos);
  EXPECT_NE(text.find("# vertices 0 to 4: frames 1:0 to 1:4"), std::string::npos);
  EXPECT_NE(text.find("FIX 0\n"), std::string::npos);
  EXPECT_NE(text.find("FIX 5\n"), std::string::npos);
  const PoseGraph read = parse_pose_graph(text, "map.g2o").or_throw();
  ASSERT_EQ(read.poses.size(), 6u);
  ASSERT_EQ(read.odometry.size(), 4u);
  ASSERT_EQ(read.loops.size(), 1u) << "the candidate is no edge of the graph";
  for (std::size_t i = 0; i < 4; ++i) {
    const client::Edge& wrote = map.graph.edges[i];
    EXPECT_LT((read.odometry[i].T_ab.t - wrote.T_ab.t).norm(), 1e-9);
    EXPECT_LT((read.odometry[i].T_ab.R - wrote.T_ab.R).norm(), 1e-9);
    EXPECT_LT((read.odometry[i].covariance - wrote.covariance).norm(), 1e-9);
    EXPECT_LT((read.poses[i].t - map.relaxation.poses[i].T_component_frame.t).norm(), 1e-9);
  }
}

TEST(GraphFiles, TearsAreListedInEachFormat) {
  const RelaxedMap map = relax_map(square(3), kLabels).or_throw();
  ASSERT_GE(map.tears.size(), 1u);
  EXPECT_GT(map.tears[0].sigmas, kTearSigmas);
  const std::string id = map.tears[0].edge.id.to_string();
  EXPECT_NE(to_g2o(map).find("# tear " + id), std::string::npos);
  EXPECT_NE(to_ply(map).find("comment tear " + id), std::string::npos);
  EXPECT_NE(to_geojson(map, {}).find("\"tears\":[{\"edge\":\"" + id), std::string::npos);
}

TEST(GraphFiles, PlyHoldsWhatItsHeaderSays) {
  const RelaxedMap map = relax_map(square(0), kLabels).or_throw();
  std::istringstream lines(to_ply(map));
  std::string line;
  std::size_t vertices = 0, edges = 0;
  ASSERT_TRUE(std::getline(lines, line) && line == "ply");
  while (std::getline(lines, line) && line != "end_header") {
    if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
    if (line.starts_with("element edge ")) edges = std::stoul(line.substr(13));
  }
  EXPECT_EQ(vertices, 6u);
  EXPECT_EQ(edges, 5u);
  std::size_t rest = 0;
  for (; std::getline(lines, line); ++rest) {
    std::istringstream words(line);
    std::size_t count = 0;
    for (std::string word; words >> word; ++count) {
    }
    EXPECT_EQ(count, rest < vertices ? 8u : 3u) << line;
  }
  EXPECT_EQ(rest, vertices + edges);
}

TEST(GraphFiles, GeojsonLiesWhereItsRootWasPut) {
  const RelaxedMap map = relax_map(square(0), kLabels).or_throw();
  // The root looks east: the second frame, 2 m before it, is 2 m to the east.
  const std::string text = to_geojson(map, {51.5, -0.12, 90});
  EXPECT_NE(text.find("\"root\":\"1:0\""), std::string::npos);
  EXPECT_NE(text.find("\"name\":\"round \\\"the\\\" square\""), std::string::npos);
  EXPECT_NE(text.find("\"label\":\"dock\",\"frame\":\"1:2\""), std::string::npos);
  EXPECT_EQ(text.find("elsewhere"), std::string::npos) << "a label of a frame that is not there";
  const std::size_t line = text.find("[[");
  ASSERT_NE(line, std::string::npos);
  double longitude[2], latitude[2], height[2];
  ASSERT_EQ(std::sscanf(text.c_str() + line, "[[%lf,%lf,%lf],[%lf,%lf,%lf]", &longitude[0], &latitude[0], &height[0],
                        &longitude[1], &latitude[1], &height[1]),
            6);
  EXPECT_NEAR(longitude[0], -0.12, 1e-9);
  EXPECT_NEAR(latitude[0], 51.5, 1e-9);
  const Vector3 second = map.relaxation.poses[1].T_component_frame.t;
  const double metres = 111'412 * std::cos(51.5 * M_PI / 180) * (longitude[1] - longitude[0]);
  EXPECT_NEAR(metres, second.z(), 0.01 * std::abs(second.z()));
  EXPECT_NEAR(111'240 * (latitude[1] - latitude[0]), -second.x(), 0.01 * std::abs(second.x()) + 1e-4);
}

}  // namespace
}  // namespace relmap::cli
