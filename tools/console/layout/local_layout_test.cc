#include "tools/console/layout/local_layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "client/relaxation.h"
#include "client/springs.h"

namespace relmap::console {
namespace {

constexpr std::uint32_t kFrames = 40;

client::Edge edge_of(EdgeId id, FrameId a, FrameId b, const Vector3& to, double sigma) {
  client::Edge edge;
  edge.id = id;
  edge.a = a;
  edge.b = b;
  edge.kind = id.ordinal == 0 ? client::EdgeKind::kOdometry : client::EdgeKind::kLoop;
  edge.carries = true;
  edge.T_ab.t = to;
  edge.covariance =
      Vector6(sigma, sigma, sigma, sigma / 10, sigma / 10, sigma / 10).array().square().matrix().asDiagonal();
  return edge;
}

// Two robots drove along the same street, the second one a metre to the right of the first. Every eighth frame of the
// second was recognised by the first.
struct Street {
  std::vector<FrameId> frames;
  std::vector<client::Edge> edges;

  explicit Street(bool recognised) {
    for (const SessionNumber session : {1u, 2u})
      for (std::uint32_t k = 0; k < kFrames; ++k) {
        frames.push_back({session, k});
        if (k > 0) edges.push_back(edge_of({{session, k}, 0}, {session, k - 1}, {session, k}, {0, 0, 1}, 0.02));
      }
    for (std::uint32_t k = 4; recognised && k < kFrames; k += 8)
      edges.push_back(edge_of({{2, k}, 1}, {1, k}, {2, k}, {1, 0, 0}, 0.05));
  }
};
// It says that the second robot was three frames, and two metres to the left, from where it was.
client::Edge wrong_closure() { return edge_of({{2, 20}, 2}, {1, 23}, {2, 20}, {-2, 0, 0}, 0.05); }

// Of a frame among others, ascending.
std::size_t position(const std::vector<FrameId>& frames, FrameId frame) {
  return static_cast<std::size_t>(std::lower_bound(frames.begin(), frames.end(), frame) - frames.begin());
}

double distance(const LocalLayout& layout, const LocalLayout::Laid& laid, FrameId a, FrameId b) {
  const auto at = [&](FrameId frame) { return laid.at[position(layout.frames, frame)]; };
  return (at(a) - at(b)).norm();
}

TEST(LocalLayout, ShowsWhatAWrongClosureBends) {
  const Street street(true);
  const LocalLayout layout = lay_out_locally(wrong_closure(), street.edges, street.frames, {}).or_throw();
  EXPECT_EQ(layout.root, (FrameId{1, 23}));
  EXPECT_TRUE(layout.with.joined && layout.without.joined);
  EXPECT_NEAR(distance(layout, layout.without, {1, 20}, {2, 20}), 1, 0.05);
  // It pulls the newer end towards where it says that this was, and others hold against it.
  const std::size_t newer = position(layout.frames, {2, 20});
  const Vector2 pulled = layout.with.at[newer] - layout.without.at[newer];
  EXPECT_GT(pulled.dot(Vector2(-2, 0) - layout.without.at[newer]), 0.2);
  EXPECT_LT(pulled.norm(), layout.metres);
  EXPECT_GT(layout.sigmas, 6);
  EXPECT_NEAR(layout.metres, std::hypot(3, 3), 0.1);
  // Far from it nothing changes.
  EXPECT_NEAR(distance(layout, layout.with, {1, 2}, {1, 12}), distance(layout, layout.without, {1, 2}, {1, 12}), 0.1);
  // The root's axes: on is up, and what is to its right lies to its right.
  const auto at = [&](FrameId frame) { return layout.without.at[position(layout.frames, frame)]; };
  EXPECT_LT(at({1, 23}).norm(), 1e-9);
  EXPECT_NEAR(at({1, 30}).y(), 7, 0.2);
  EXPECT_NEAR(at({2, 23}).x(), 1, 0.2);
}

// Once refined, every edge agrees with the wrong closure, and only what was measured still contradicts it.
TEST(LocalLayout, WithoutAClosureInForceIsMadeOfWhatWasMeasured) {
  const Street street(true);
  std::vector<client::Edge> edges = street.edges;
  edges.push_back(wrong_closure());
  std::vector<client::RelaxationEdge> pulling;
  for (const client::Spring& spring : client::springs_of(edges)) pulling.push_back(spring.relaxed);
  const auto refined = client::relax(street.frames, pulling).or_throw();
  const auto pose = [&](FrameId frame) { return refined.poses[position(street.frames, frame)].T_component_frame; };
  for (client::Edge& edge : edges) {
    edge.measured = {edge.T_ab, edge.covariance};
    edge.T_ab = pose(edge.a).inverse() * pose(edge.b);
  }
  client::Edge closure = edges.back();
  const LocalLayout raw = lay_out_locally(wrong_closure(), street.edges, street.frames, {}).or_throw();
  const LocalLayout layout = lay_out_locally(closure, edges, street.frames, {}).or_throw();
  EXPECT_NEAR(distance(layout, layout.without, {1, 20}, {2, 20}), 1, 0.05);
  EXPECT_NEAR(layout.metres, raw.metres, 1e-6);
  EXPECT_GT(layout.sigmas, 6);
  for (std::size_t k = 0; k < layout.frames.size(); ++k)
    EXPECT_LT((layout.without.at[k] - raw.without.at[k]).norm(), 1e-6);

  // One that is not in force has refined nothing: without it the map is as it is.
  closure.state = client::EdgeState::kCandidate;
  edges.back() = closure;
  const LocalLayout candidate = lay_out_locally(closure, edges, street.frames, {}).or_throw();
  double bent = 0;
  for (std::size_t k = 0; k < layout.frames.size(); ++k) {
    EXPECT_LT((candidate.without.at[k] - layout.with.at[k]).norm(), 1e-3);
    bent = std::max(bent, (candidate.without.at[k] - raw.without.at[k]).norm());
  }
  EXPECT_GT(bent, 0.1);
}

TEST(LocalLayout, LeavesOutWhatGoesWithIt) {
  const Street street(true);
  std::vector<EdgeId> all;
  for (const client::Edge& edge : street.edges)
    if (edge.id.ordinal > 0) all.push_back(edge.id);
  const LocalLayout layout = lay_out_locally(wrong_closure(), street.edges, street.frames, all).or_throw();
  EXPECT_FALSE(layout.without.joined);
  EXPECT_EQ(layout.metres, 0);
  // What is not joined is drawn where it was.
  EXPECT_LT(
      std::abs(distance(layout, layout.without, {1, 20}, {2, 20}) - distance(layout, layout.with, {1, 20}, {2, 20})),
      0.5);
  for (const auto& closure : layout.closures) EXPECT_TRUE(closure.goes);
  EXPECT_EQ(layout.closures.size(), all.size() + 1);
}

TEST(LocalLayout, OfAClosureThatIsNotInForceShowsWhatItWouldDo) {
  const Street street(false);
  client::Edge candidate = edge_of({{2, 20}, 1}, {1, 20}, {2, 20}, {1, 0, 0}, 0.05);
  candidate.state = client::EdgeState::kCandidate;
  candidate.carries = false;
  const LocalLayout layout = lay_out_locally(candidate, street.edges, street.frames, {}).or_throw();
  EXPECT_TRUE(layout.with.joined);
  EXPECT_FALSE(layout.without.joined);
  EXPECT_NEAR(distance(layout, layout.with, {1, 20}, {2, 20}), 1, 0.01);
  ASSERT_EQ(layout.closures.size(), 1u);
  EXPECT_FALSE(layout.closures[0].in_force);
}

TEST(LocalLayout, IsToldAsJson) {
  const Street street(true);
  const LocalLayout layout = lay_out_locally(wrong_closure(), street.edges, street.frames, {}).or_throw();
  const auto document = nlohmann::json::parse(json_of(layout));
  EXPECT_EQ(document["edge"], "2:20/2");
  EXPECT_EQ(document["root"], "1:23");
  EXPECT_EQ(document["with"]["frames"].size(), 2 * kFrames);
  EXPECT_EQ(document["with"]["x"].size(), 2 * kFrames);
  EXPECT_EQ(document["without"]["y"].size(), 2 * kFrames);
  EXPECT_EQ(document["without"]["runs"], (std::vector<int>{0, kFrames}));
  for (const auto& closure : document["closures"])
    if (closure["edge"] == "2:20/2") {
      EXPECT_EQ(document["with"]["frames"][closure["a"].get<std::size_t>()], "1:23");
      EXPECT_EQ(document["with"]["frames"][closure["b"].get<std::size_t>()], "2:20");
      EXPECT_EQ(closure["goes"], true);
      EXPECT_EQ(closure["in_force"], true);
    }
}

}  // namespace
}  // namespace relmap::console
