#include "tools/relmap/relaxed_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relmap::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

client::Edge step(FrameId a, FrameId b, const Vector3& t) {
  client::Edge edge;
  edge.id = {b, 0};
  edge.a = a;
  edge.b = b;
  edge.kind = client::EdgeKind::kOdometry;
  edge.state = client::EdgeState::kAccepted;
  edge.reason = Reason::MOTION;
  edge.carries = true;
  edge.T_ab.t = t;
  edge.covariance = 1e-4 * Matrix6::Identity();
  return edge;
}

client::Edge closure(FrameId a, FrameId b, const Vector3& t) {
  client::Edge edge = step(a, b, t);
  edge.id = {b, 1};
  edge.kind = client::EdgeKind::kLoop;
  edge.reason = Reason::CONSISTENT;
  return edge;
}

// What a robot guesses of a step that it did not see.
client::Edge guess(FrameId a, FrameId b, const Vector3& t, MotionSource source, double sigma) {
  client::Edge edge = step(a, b, t);
  edge.kind = client::EdgeKind::kPrior;
  edge.source = source;
  edge.unmeasured = true;
  edge.covariance = sigma * sigma * Matrix6::Identity();
  return edge;
}

MapGraph graph_of(std::vector<client::Edge> edges) {
  MapGraph graph;
  for (const client::Edge& edge : edges)
    for (const FrameId end : {edge.a, edge.b}) {
      graph.frames.insert(end);
      graph.names[end.session] = "drive " + std::to_string(end.session);
    }
  graph.edges = std::move(edges);
  return graph;
}

constexpr FrameId at(std::uint32_t index, SessionNumber session = 1) { return {session, index}; }
const Vector3 kAhead(0, 0, 1);

TEST(RelaxedMap, PartsAreTheConnectedComponentsLargestFirst) {
  const RelaxedMap map = relax_map(graph_of({step(at(0, 1), at(1, 1), kAhead), step(at(0, 2), at(1, 2), kAhead),
                                             step(at(1, 2), at(2, 2), kAhead), closure(at(5, 3), at(2, 2), {1, 0, 0})}),
                                   {{"dock", {at(1, 2), at(9, 9)}}})
                             .or_throw();
  ASSERT_EQ(map.parts.size(), 2u);
  EXPECT_EQ(map.parts[0].root, at(0, 2));
  EXPECT_EQ(map.parts[0].frames.size(), 4u);
  EXPECT_THAT(map.parts[0].sessions(), ElementsAre(2u, 3u));
  ASSERT_EQ(map.parts[0].labels.size(), 1u) << "a frame that is not there has none";
  EXPECT_EQ(map.parts[0].labels[0].text, "dock");
  EXPECT_EQ(map.parts[1].root, at(0, 1));
  EXPECT_LT((map.parts[0].find(at(5, 3))->t - Vector3(-1, 0, 2)).norm(), 1e-6);
  EXPECT_EQ(map.parts[0].find(at(0, 1)), nullptr);
}

TEST(RelaxedMap, TheRootCanBeChosen) {
  std::vector<client::Edge> edges;
  for (std::uint32_t i = 0; i < 6; ++i) edges.push_back(step(at(i, 1), at(i + 1, 1), kAhead));
  edges.push_back(step(at(0, 2), at(1, 2), kAhead));
  Vector6 turn;
  turn << 0, 0, 1, 0, M_PI / 2, 0;
  edges.back().T_ab = SE3::exp(turn);
  const RelaxedMap map = relax_map(graph_of(edges), {}, at(1, 2)).or_throw();
  EXPECT_EQ(map.parts[0].root, at(1, 2)) << "its part is the first, small as it is";
  EXPECT_TRUE(map.parts[0].find(at(1, 2))->R.isIdentity(1e-12));
  const SE3 expected = edges.back().T_ab.inverse();
  EXPECT_LT((map.parts[0].find(at(0, 2))->t - expected.t).norm(), 1e-9);
  EXPECT_LT((map.parts[0].find(at(0, 2))->R - expected.R).norm(), 1e-9);
  EXPECT_EQ(map.parts[1].root, at(0, 1));
  EXPECT_EQ(relax_map(graph_of(edges), {}, at(7, 1)).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(relax_map({}, {}).reason(), Reason::EMPTY_MAP);
}

TEST(RelaxedMap, AnUnsensedStepConnectsNothing) {
  const RelaxedMap map =
      relax_map(graph_of({step(at(0), at(1), kAhead), guess(at(1), at(2), {0, 0, 0}, MotionSource::kUnsensed, 10),
                          step(at(2), at(3), kAhead), step(at(3), at(4), kAhead)}),
                {})
          .or_throw();
  ASSERT_EQ(map.parts.size(), 2u);
  EXPECT_EQ(map.parts[0].root, at(2));
  EXPECT_EQ(map.parts[1].root, at(0));
  for (const MapPart& part : map.parts) {
    ASSERT_EQ(part.doubtful.size(), 1u);
    EXPECT_EQ(part.doubtful[0].words(), "1:1 to 1:2: unsensed, sigma 10.00 m; its ends are in different parts");
  }
}

// The robot was carried 5 m aside; closures behind that with what it saw before tell where to.
TEST(RelaxedMap, ClosuresPlaceWhatFollowsAnUnsensedStep) {
  const RelaxedMap map =
      relax_map(graph_of({step(at(0), at(1), kAhead), guess(at(1), at(2), {0, 0, 0}, MotionSource::kUnsensed, 10),
                          step(at(2), at(3), kAhead), closure(at(0), at(3), {5, 0, 1})}),
                {})
          .or_throw();
  ASSERT_EQ(map.parts.size(), 1u);
  EXPECT_LT((map.parts[0].find(at(2))->t - Vector3(5, 0, 0)).norm(), 1e-6);
  EXPECT_TRUE(map.parts[0].tears.empty());
  ASSERT_EQ(map.parts[0].doubtful.size(), 1u);
  EXPECT_THAT(map.parts[0].doubtful[0].words(), HasSubstr("measured edges also connect its ends"));
}

TEST(RelaxedMap, LandmarksThatAreSeenFromBothSidesMeasureAStep) {
  client::Edge supported = guess(at(1), at(2), {3, 0, 0}, MotionSource::kUnsensed, 10);
  supported.unmeasured = false;  // as the daemon says of it
  const RelaxedMap map =
      relax_map(graph_of({step(at(0), at(1), kAhead), supported, step(at(2), at(3), kAhead)}), {}).or_throw();
  EXPECT_EQ(map.parts.size(), 1u);
  EXPECT_TRUE(map.parts[0].doubtful.empty());
}

TEST(RelaxedMap, DeadReckoningCountsWithItsCovarianceAndIsNamed) {
  std::vector<client::Edge> edges{step(at(0), at(1), kAhead),
                                  guess(at(1), at(2), {0, 0, 2}, MotionSource::kConstantVelocity, 0.5),
                                  step(at(2), at(3), kAhead)};
  const RelaxedMap alone = relax_map(graph_of(edges), {}).or_throw();
  ASSERT_EQ(alone.parts.size(), 1u) << "it says how far off it may be";
  EXPECT_LT((alone.parts[0].find(at(3))->t - Vector3(0, 0, 4)).norm(), 1e-6);
  ASSERT_EQ(alone.parts[0].doubtful.size(), 1u);
  EXPECT_EQ(alone.parts[0].doubtful[0].words(),
            "1:1 to 1:2: constant velocity, sigma 0.50 m; no measured edges connect its ends");
  edges.push_back(closure(at(0), at(3), {0, 0, 3.2}));
  const RelaxedMap closed = relax_map(graph_of(edges), {}).or_throw();
  EXPECT_LT((closed.parts[0].find(at(3))->t - Vector3(0, 0, 3.2)).norm(), 1e-3) << "what was measured counts more";
  EXPECT_TRUE(closed.parts[0].tears.empty());
}

// A step that landmarks have measured later keeps the covariance of its first guess. In a loop with another guess that
// is 9 m off, it used to absorb most of that error.
TEST(RelaxedMap, AGuessDoesNotCountIfMeasuredEdgesConnectItsEnds) {
  client::Edge measured = guess(at(3), at(4), kAhead, MotionSource::kConstantVelocity, 15);
  measured.unmeasured = false;
  const RelaxedMap map = relax_map(graph_of({step(at(0), at(1), kAhead),
                                             guess(at(1), at(2), {0, 0, 10}, MotionSource::kConstantVelocity, 5),
                                             step(at(2), at(3), kAhead), measured, closure(at(0), at(4), {0, 0, 4})}),
                                   {})
                             .or_throw();
  ASSERT_EQ(map.parts.size(), 1u);
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_NEAR(map.parts[0].find(at(i))->t.z(), i, 1e-6) << i;
}

TEST(RelaxedMap, AGapIsNamedAsGap) {
  client::Edge gap = guess(at(1), at(9), {0, 0, 8}, MotionSource::kVision, 0.1);
  gap.reason = Reason::DECLARED_GAP;
  const RelaxedMap map = relax_map(graph_of({step(at(0), at(1), kAhead), gap}), {}).or_throw();
  ASSERT_EQ(map.parts.size(), 1u);
  EXPECT_THAT(map.parts[0].doubtful.at(0).words(), HasSubstr("1:1 to 1:9: gap, sigma 0.10 m"));
}

// A lift: the odometry has it that the robot stood still for three steps, and is sure of it; a ramp leads back down.
TEST(RelaxedMap, WhereARobotWasCarriedClosuresCountAndNotItsOdometry) {
  constexpr double kFloor = 4;
  std::vector<client::Edge> edges{step(at(0), at(1), kAhead)};
  for (std::uint32_t i = 1; i < 4; ++i) {
    edges.push_back(step(at(i), at(i + 1), {0, 0, 0}));
    edges.back().carried_by = {{at(10), 1}, {at(11), 1}};
  }
  for (std::uint32_t i = 4; i < 11; ++i) edges.push_back(step(at(i), at(i + 1), {0, kFloor / 7, -1.0 / 7}));
  // The start again, twice: the odometry says that it lies 4 m below.
  edges.push_back(closure(at(1), at(10), {0, -kFloor / 7, -6.0 / 7}));
  edges.push_back(closure(at(1), at(11), {0, 0, -1}));
  const RelaxedMap map = relax_map(graph_of(edges), {}).or_throw();
  ASSERT_EQ(map.parts.size(), 1u);
  const MapPart& part = map.parts[0];
  EXPECT_LT((part.find(at(11))->t - Vector3(0, 0, 0)).norm(), 0.01);
  EXPECT_LT((part.find(at(4))->t - Vector3(0, -kFloor, 1)).norm(), 0.01) << "up is -y";
  EXPECT_TRUE(part.tears.empty());
  ASSERT_EQ(part.doubtful.size(), 3u);
  EXPECT_EQ(part.doubtful[0].words(),
            "1:1 to 1:2: according to closure 1:10/1 and 1 more; no measured edges connect its ends");
}

TEST(RelaxedMap, TearsAreListedInMetresWorstFirst) {
  std::vector<client::Edge> edges;
  for (std::uint32_t i = 0; i < 10; ++i) edges.push_back(step(at(i), at(i + 1), kAhead));
  edges.push_back(closure(at(0), at(10), {0, 0, 4}));
  const RelaxedMap map = relax_map(graph_of(edges), {}).or_throw();
  ASSERT_FALSE(map.parts[0].tears.empty());
  const client::Tear& worst = map.parts[0].tears[0];
  EXPECT_EQ(worst.edge, (EdgeId{at(10), 1}));
  EXPECT_GT(worst.sigmas, client::kTearSigmas);
  EXPECT_THAT(worst.words(), HasSubstr("1:10/1 from 1:0 to 1:10: "));
  EXPECT_NEAR(worst.metres, map.parts[0].find(at(10))->t.z() - 4, 1e-6);
}

}  // namespace
}  // namespace relmap::cli
