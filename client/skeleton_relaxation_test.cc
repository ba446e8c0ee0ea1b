#include "client/skeleton_relaxation.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "client/skeleton_picture.h"

namespace relmap::client {
namespace {

// Points along a way of which each step is `step`, with indices `stride` apart.
Skeleton::Chain chain(SessionNumber session, std::uint32_t points, const SE3& step, std::uint32_t stride = 10) {
  Skeleton::Chain chain{session, {}};
  for (std::uint32_t i = 0; i < points; ++i) {
    Skeleton::Point& point = chain.points.emplace_back();
    point.frame = {session, i * stride};
    if (i == 0) continue;
    point.T_before_this = step;
    point.translation_variance = 1e-4;
    point.rotation_variance = 1e-6;
    point.frames = stride;
  }
  return chain;
}

Skeleton::Closure closure(FrameId b, FrameId a, const SE3& T_ab = {}) {
  Skeleton::Closure closure;
  closure.id = {b, 1};
  closure.a = a;
  closure.state = EdgeState::kAccepted;
  closure.carries = true;
  closure.T_ab = T_ab;
  closure.translation_variance = closure.rotation_variance = 1e-6;
  return closure;
}

const SE3 kMetreAhead{Matrix3::Identity(), {0, 0, 1}};

TEST(SkeletonRelaxation, AClosureClosesACircleThatDrifted) {
  constexpr std::uint32_t kPoints = 40;
  const double turn = 2 * std::numbers::pi / kPoints;
  Skeleton skeleton;
  skeleton.chains = {chain(1, kPoints + 1, {so3_exp({0, 1.02 * turn, 0}), {0, 0, 1}})};
  const FrameId first{1, 0}, last{1, 10 * kPoints};
  const auto gap = [&] {
    const auto relaxed = relax_skeleton(skeleton).or_throw();
    EXPECT_EQ(relaxed.parts.size(), 1u);
    EXPECT_EQ(relaxed.parts[0].places.size(), kPoints + 1);
    return (*relaxed.parts[0].find(last)).t.norm();
  };
  EXPECT_GT(gap(), 0.1);
  skeleton.closures = {closure(last, first)};
  EXPECT_LT(gap(), 0.01);
  skeleton.closures[0].state = EdgeState::kCandidate;
  EXPECT_GT(gap(), 0.1) << "a candidate pulls nothing";
}

TEST(SkeletonRelaxation, TheChosenRootComesFirstThenTheLargestPart) {
  Skeleton skeleton;
  skeleton.chains = {chain(1, 5, kMetreAhead), chain(2, 9, kMetreAhead), chain(3, 3, kMetreAhead)};
  auto relaxed = relax_skeleton(skeleton).or_throw();
  ASSERT_EQ(relaxed.parts.size(), 3u);
  EXPECT_EQ(relaxed.parts[0].root, (FrameId{2, 0}));
  EXPECT_NEAR(relaxed.parts[0].find({2, 80})->t.z(), 8, 1e-6);
  EXPECT_EQ(relaxed.parts[0].find({1, 0}), nullptr);
  relaxed = relax_skeleton(skeleton, {.root = FrameId{3, 10}}).or_throw();
  EXPECT_EQ(relaxed.parts[0].root, (FrameId{3, 10}));
  EXPECT_NEAR(relaxed.parts[0].find({3, 0})->t.z(), -1, 1e-6);
  EXPECT_EQ(relaxed.parts[1].root, (FrameId{2, 0}));
  EXPECT_EQ(relax_skeleton(skeleton, {.root = FrameId{3, 11}}).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(relax_skeleton({}).reason(), Reason::EMPTY_MAP);
}

TEST(SkeletonRelaxation, AGuessCountsOnlyWhereNothingMeasuredIsBeside) {
  Skeleton skeleton;
  skeleton.chains = {chain(1, 5, kMetreAhead), chain(2, 5, kMetreAhead)};
  skeleton.chains[0].points[2].unmeasured = true;
  skeleton.chains[0].points[2].T_before_this.t.z() = 9;
  skeleton.chains[0].points[2].translation_variance = 1e-8;
  EXPECT_NEAR(relax_skeleton(skeleton, {.root = FrameId{1, 0}}).or_throw().parts[0].find({1, 40})->t.z(), 12, 1e-6);
  skeleton.closures = {closure({2, 0}, {1, 0}), closure({2, 40}, {1, 40})};
  EXPECT_NEAR(relax_skeleton(skeleton, {.root = FrameId{1, 0}}).or_throw().parts[0].find({1, 40})->t.z(), 4, 1e-3);
}

TEST(SkeletonRelaxation, WhereTheRobotWasCarriedTheClosuresSay) {
  Skeleton skeleton;
  skeleton.chains = {chain(1, 5, kMetreAhead), chain(2, 5, kMetreAhead)};
  skeleton.chains[1].points[2].carried = true;
  skeleton.closures = {closure({2, 10}, {1, 10}), closure({2, 20}, {1, 40}), closure({2, 30}, {1, 30})};
  skeleton.closures.pop_back();
  const auto relaxed = relax_skeleton(skeleton, {.root = FrameId{1, 0}}).or_throw();
  EXPECT_NEAR(relaxed.parts[0].find({2, 10})->t.z(), 1, 1e-3);
  EXPECT_NEAR(relaxed.parts[0].find({2, 20})->t.z(), 4, 1e-3);
}

TEST(SkeletonRelaxation, ManyPointsAreRelaxedAsWellAsFew) {
  Skeleton skeleton;
  skeleton.chains = {chain(1, 2000, {so3_exp({0, 0.001, 0}), {0, 0, 1}})};
  SE3 T_first_last;
  for (const Skeleton::Point& point : skeleton.chains[0].points) T_first_last = T_first_last * point.T_before_this;
  T_first_last.t += Vector3(3, 0, 3);
  skeleton.closures = {closure({1, 19990}, {1, 0}, T_first_last.normalized())};
  SkeletonLayout layout;
  layout.relaxation.max_direct = 10'000;
  const auto directly = relax_skeleton(skeleton, layout).or_throw();
  layout.relaxation.max_direct = 200;
  const auto relaxed = relax_skeleton(skeleton, layout).or_throw();
  ASSERT_EQ(relaxed.parts[0].places.size(), 2000u);
  for (std::size_t i = 0; i < 2000; ++i)
    EXPECT_LT((relaxed.parts[0].places[i].T_root_frame.t - directly.parts[0].places[i].T_root_frame.t).norm(), 0.1)
        << i;
}

TEST(SkeletonPicture, ShowsEveryPointStepAndClosureByItsKind) {
  Skeleton skeleton;
  skeleton.chains = {chain(1, 5, kMetreAhead), chain(2, 5, kMetreAhead)};
  skeleton.chains[0].points[2].unmeasured = true;
  skeleton.chains[1].points[3].carried = true;
  skeleton.closures = {closure({2, 10}, {1, 10}), closure({2, 20}, {1, 20})};
  skeleton.closures[1].state = EdgeState::kCandidate;
  MapPicture picture;
  const RelaxedSkeleton layout = relax_skeleton(skeleton).or_throw();
  add_skeleton(picture, skeleton, layout);
  ASSERT_EQ(picture.parts.size(), layout.parts.size());
  std::size_t points = 0;
  for (const MapPicture::Part& part : picture.parts) points += part.frames.size();
  EXPECT_EQ(points, skeleton.points());
  std::map<MapPicture::EdgeKind, int> kinds;
  for (const MapPicture::Edge& edge : picture.edges) ++kinds[edge.kind];
  EXPECT_EQ(kinds, (std::map<MapPicture::EdgeKind, int>{{MapPicture::EdgeKind::kMotion, 6},
                                                        {MapPicture::EdgeKind::kUnmeasuredMotion, 1},
                                                        {MapPicture::EdgeKind::kCarriedMotion, 1},
                                                        {MapPicture::EdgeKind::kLoopAccepted, 1},
                                                        {MapPicture::EdgeKind::kLoopCandidate, 1}}));
}

// A skeleton that is still being read may have closures whose ends are not there yet.
TEST(SkeletonRelaxation, AClosureWithoutItsEndsIsLeftOut) {
  Skeleton skeleton;
  skeleton.chains = {chain(1, 5, kMetreAhead)};
  skeleton.closures = {closure({1, 40}, {9, 0}), closure({1, 41}, {1, 0})};
  EXPECT_EQ(relax_skeleton(skeleton).or_throw().parts.size(), 1u);
}

}  // namespace
}  // namespace relmap::client
