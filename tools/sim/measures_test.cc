#include "tools/sim/measures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace relmap::sim {
namespace {

std::vector<SE3> line(std::size_t frames) {
  std::vector<SE3> poses(frames);
  for (std::size_t i = 0; i < frames; ++i) poses[i] = {so3_exp({0, 0.3, 0}), {1, 0, 0.1 * static_cast<double>(i)}};
  return poses;
}

TEST(RegistrationError, DoesNotDependOnTheWorldsFrame) {
  const auto truth = line(20);
  const SE3 elsewhere{so3_exp({1, 2, 3}), {4, 5, 6}};
  const auto unroll = [&](std::size_t root) {
    std::vector<std::optional<SE3>> poses;
    for (const SE3& pose : truth) poses.push_back((elsewhere * truth[root]).inverse() * (elsewhere * pose));
    return poses;
  };
  const auto error = registration_error(truth, unroll);
  EXPECT_NEAR(error.mean_m, 0, 1e-12);
  EXPECT_EQ(error.roots, 20U);
}

TEST(RegistrationError, IsTheMeanDistanceOverFramesAndRoots) {
  const std::vector<SE3> truth = {{Matrix3::Identity(), {0, 0, 0}}, {Matrix3::Identity(), {1, 0, 0}}};
  // The map has the two 1.5 m apart: each is 0.5 m off when seen from the other.
  const auto unroll = [&](std::size_t root) {
    const Vector3 other(root == 0 ? 1.5 : -1.5, 0, 0);
    std::vector<std::optional<SE3>> poses(2, SE3());
    poses[1 - root] = SE3{Matrix3::Identity(), other};
    return poses;
  };
  EXPECT_NEAR(registration_error(truth, unroll).mean_m, 0.25, 1e-12);
}

TEST(RegistrationError, LeavesOutAndCountsWhatIsNotConnected) {
  const auto truth = line(3);
  const auto unroll = [&](std::size_t root) {
    std::vector<std::optional<SE3>> poses(3);
    poses[root] = SE3();
    return poses;
  };
  const auto error = registration_error(truth, unroll);
  EXPECT_EQ(error.mean_m, 0);
  EXPECT_EQ(error.disconnected, 6U);
}

TEST(Revisits, AreEarlierNearAndLookTheSameWay) {
  // Thirty steps of 1 s away, then back to the start: half turned, then turned as before.
  std::vector<SE3> truth;
  std::vector<std::int64_t> time;
  for (int i = 0; i < 30; ++i) truth.push_back({Matrix3::Identity(), {0, 0, 2.0 * i}});
  truth.push_back({so3_exp({0, std::numbers::pi, 0}), {0.1, 0, 0}});
  truth.push_back({Matrix3::Identity(), {0.2, 0, 0.5}});
  for (std::size_t i = 0; i < truth.size(); ++i) time.push_back(1'000'000 * static_cast<std::int64_t>(i));
  const auto revisits = find_revisits(truth, time);
  ASSERT_EQ(revisits.size(), 1U);
  EXPECT_EQ(revisits[0].frame, 31U);
  EXPECT_EQ(revisits[0].earlier, 0U);

  const auto error = revisit_error(truth, revisits, [&](std::size_t a, std::size_t b) -> std::optional<SE3> {
    SE3 relative = truth[a].inverse() * truth[b];
    relative.t.x() += 0.3;
    return relative;
  });
  EXPECT_NEAR(error.mean_m, 0.3, 1e-12);
  EXPECT_NEAR(error.mean_rad, 0, 1e-6);
  EXPECT_EQ(error.revisits, 1U);
}

}  // namespace
}  // namespace relmap::sim
