#include "tools/relmap/map_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/relmap/map_drawing.h"

namespace relmap::cli {
namespace {

using client::Skeleton;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr FrameId point_at(std::uint32_t index, SessionNumber session = 1) { return {session, index}; }

// A drive of 100 frames, a metre each, straight on, of which every tenth is a point.
Skeleton drive() {
  Skeleton skeleton;
  skeleton.frames = 101;
  Skeleton::Chain& chain = skeleton.chains.emplace_back();
  chain.session = 1;
  for (std::uint32_t index = 0; index <= 100; index += 10) {
    Skeleton::Point& point = chain.points.emplace_back();
    point.frame = point_at(index);
    point.time_us = 1'000'000 * std::int64_t{index + 1};
    if (index == 0) continue;
    point.T_before_this.t = {0, 0, 10};
    point.translation_variance = 0.03;
    point.rotation_variance = 0.003;
    point.frames = 10;
  }
  return skeleton;
}

// That the robot came back to where it began, and that it did not.
void close_loop(Skeleton& skeleton, double metres) {
  Skeleton::Closure& closure = skeleton.closures.emplace_back();
  closure.id = {point_at(100), 1};
  closure.a = point_at(0);
  closure.state = client::EdgeState::kAccepted;
  closure.carries = true;
  closure.T_ab.t = {0, 0, metres};
  closure.translation_variance = closure.rotation_variance = 3e-4;
}

MapShape shape_of(Skeleton skeleton) {
  MapShape shape;
  shape.skeleton = std::move(skeleton);
  EXPECT_TRUE(lay_out(shape).ok());
  return shape;
}

TEST(MapShape, HasEveryKeyframeOfASmallMapAndFewerPointsOfALargerOne) {
  EXPECT_EQ(client::level_for(1), 3u);
  EXPECT_EQ(client::level_for(50'000), 3u);
  std::uint32_t before = 3;
  for (std::uint64_t keyframes = 50'001; keyframes < 10'000'000; keyframes += keyframes / 3) {
    EXPECT_LT(client::level_for(keyframes), 3u);
    EXPECT_LE(client::level_for(keyframes), before);
    before = client::level_for(keyframes);
  }
  EXPECT_EQ(before, 0u);
}

TEST(MapShape, AFrameBetweenPointsBecomesOneInProportion) {
  Skeleton skeleton = drive();
  add_points(skeleton, {point_at(23), point_at(23), point_at(27), point_at(40), point_at(500), point_at(3, 2)});
  const std::vector<Skeleton::Point>& points = skeleton.chains[0].points;
  ASSERT_EQ(points.size(), 13u);
  EXPECT_EQ(points[3].frame, point_at(23));
  EXPECT_EQ(points[4].frame, point_at(27));
  EXPECT_EQ(points[5].frame, point_at(30));
  EXPECT_EQ(points[3].time_us, 24'000'000);
  std::uint32_t frames = 0;
  double variance = 0;
  SE3 T;
  for (std::size_t i = 3; i < 6; ++i) {
    frames += points[i].frames;
    variance += points[i].translation_variance;
    T = T * points[i].T_before_this;
    EXPECT_NEAR(points[i].T_before_this.t.z(), points[i].frames, 1e-9);
  }
  EXPECT_EQ(frames, 10u);
  EXPECT_NEAR(variance, 0.03, 1e-12);
  EXPECT_NEAR(T.t.z(), 10, 1e-9);
  const MapShape shape = shape_of(skeleton);
  EXPECT_NEAR(shape.find(point_at(23))->t.z(), 23, 1e-6);
  EXPECT_EQ(shape.find(point_at(24)), nullptr);
}

TEST(MapShape, ContradictionsAreTearsOfTheClosure) {
  Skeleton sound = drive();
  close_loop(sound, 100);
  EXPECT_THAT(tears_of(shape_of(sound)), IsEmpty());
  EXPECT_THAT(strained_of(shape_of(sound)), IsEmpty());
  Skeleton torn = drive();
  close_loop(torn, 40);
  const MapShape shape = shape_of(torn);
  const std::vector<client::Tear> tears = tears_of(shape);
  ASSERT_FALSE(tears.empty());
  EXPECT_GT(tears[0].sigmas, client::kTearSigmas);
  ASSERT_FALSE(strained_of(shape).empty());
  EXPECT_EQ(strained_of(shape)[0].edge, (EdgeId{point_at(100), 1}));
  for (const client::Tear& tear : tears)
    EXPECT_THAT(tear.words(), HasSubstr(tear.edge.valid() ? "1:100/1 from 1:" : "motion from 1:"));
}

TEST(MapShape, ATornClosureIsListedOnce) {
  const auto strain = [](std::uint32_t index, double sigmas) {
    client::Tear tear;
    tear.edge = {point_at(index), 1};
    tear.a = point_at(0);
    tear.b = point_at(index);
    tear.sigmas = sigmas;
    return tear;
  };
  client::Tear motion = strain(5, 8);
  motion.edge = {};
  const std::vector<client::Tear> tears{strain(1, 20), strain(2, 9), motion},
      closures{strain(1, 20), strain(2, 9), strain(3, 2)};
  EXPECT_THAT(client::tear_lines(tears, closures, 8),
              ElementsAre(HasSubstr("tear: 1:1/1 from "), HasSubstr("tear: 1:2/1 from "),
                          HasSubstr("tear: motion from "), HasSubstr("stretched closure: 1:3/1 from ")));
  EXPECT_THAT(client::tear_lines(tears, closures, 1),
              ElementsAre(HasSubstr("tear: 1:1/1 from "), "3 tears in all", HasSubstr("stretched closure: 1:2/1 from "),
                          HasSubstr("stretched closure: 1:3/1 from ")))
      << "what the list of tears leaves out is not lost";
  EXPECT_THAT(client::tear_lines({}, {strain(3, 2)}, 8),
              ElementsAre("no tear: the picture stretches no edge by more than 6 sigmas",
                          HasSubstr("stretched closure: 1:3/1 from ")));
}

// Stamps are as short as a narrow legend needs them: a break within a number could be read as two.
TEST(MapShape, TimesInTheLegendHaveNoFractionsOfASecond) {
  MapShape shape = shape_of(drive());
  client::MapPicture picture = picture_of(shape, {});
  colour_by_time(shape, picture);
  ASSERT_TRUE(picture.scale);
  EXPECT_EQ(picture.scale->low, "1970-01-01 00:00:01 UTC");
  EXPECT_EQ(picture.scale->high, "1970-01-01 00:01:41 UTC");
  for (Skeleton::Point& point : shape.skeleton.chains[0].points) point.time_us = 0;
  picture = picture_of(shape, {});
  colour_by_time(shape, picture);
  EXPECT_EQ(picture.scale->low + picture.scale->high, "") << "no time is known";
}

TEST(MapShape, TheUncertaintyGrowsWithTheWayFromTheRoot) {
  const std::vector<double> sigmas = uncertainty_of(shape_of(drive()))[0];
  ASSERT_EQ(sigmas.size(), 11u);
  EXPECT_EQ(sigmas[0], 0);
  for (std::size_t i = 1; i < sigmas.size(); ++i) EXPECT_GT(sigmas[i], sigmas[i - 1]);
}

// A point in a straight stretch stands for many keyframes, one beside a junction for one.
TEST(MapShape, TheUncertaintyOfKeyframesCountsWhatPointsStandFor) {
  Skeleton skeleton = drive();
  skeleton.chains[0].points[10].frames = 1000;
  const MapShape shape = shape_of(skeleton);
  const std::vector<double> of_points = uncertainty_of(shape)[0];
  const std::vector<Weighted> sigmas = keyframe_sigmas(shape);
  ASSERT_EQ(sigmas.size(), 11u);
  EXPECT_EQ(sigmas[0].value, 0);
  std::uint64_t keyframes = 0;
  for (const Weighted& sigma : sigmas) keyframes += sigma.weight;
  EXPECT_EQ(keyframes, 1u + 9 * 10 + 1000);
  EXPECT_EQ(weighted_quantile(sigmas, 0.5), of_points[shape.at.at(point_at(100)).place]);
  EXPECT_GT(weighted_quantile(sigmas, 0.5), quantile(of_points, 0.5));
}

TEST(MapShape, CountsKeyframesByDayAcrossMidnight) {
  Skeleton skeleton = drive();
  constexpr std::int64_t kDay = 86'400'000'000;
  std::int64_t time = 20'000 * kDay - 45'000'000;  // midnight after 45 of the frames, one a second
  for (Skeleton::Point& point : skeleton.chains[0].points) {
    point.time_us = time;
    time += 10'000'000;
  }
  EXPECT_THAT(keyframes_by_day(skeleton), ElementsAre(Pair("2024-10-03", 45), Pair("2024-10-04", 56)));
}

TEST(MapShape, AFrameWhoseTimeIsNotKnownHasNoDay) {
  constexpr std::int64_t kDay = 86'400'000'000;
  Skeleton skeleton = drive();
  for (Skeleton::Point& point : skeleton.chains[0].points) point.time_us += 20'000 * kDay;
  skeleton.chains[0].points[3].time_us = 0;
  // 101 keyframes without the point itself, and those between it and its neighbours.
  EXPECT_THAT(keyframes_by_day(skeleton), ElementsAre(Pair("2024-10-04", 101 - 10 - 9)));
  for (Skeleton::Point& point : skeleton.chains[0].points) point.time_us = 0;
  EXPECT_THAT(keyframes_by_day(skeleton), IsEmpty());
}

TEST(MapShape, AFrameBesideAPointWhoseTimeIsNotKnownHasNone) {
  Skeleton skeleton = drive();
  skeleton.chains[0].points[3].time_us = 0;  // of frame 30
  add_points(skeleton, {point_at(15), point_at(25), point_at(35)});
  const std::vector<Skeleton::Point>& points = skeleton.chains[0].points;
  ASSERT_EQ(points.size(), 14u);
  EXPECT_EQ(points[2].frame, point_at(15));
  EXPECT_EQ(points[2].time_us, 16'000'000);
  EXPECT_EQ(points[4].frame, point_at(25));
  EXPECT_EQ(points[4].time_us, 0);
  EXPECT_EQ(points[6].frame, point_at(35));
  EXPECT_EQ(points[6].time_us, 0);
}

TEST(MapShape, ThePictureCountsWhatItsPointsStandFor) {
  Skeleton skeleton = drive();
  close_loop(skeleton, 100);
  skeleton.closures[0].alike = 12;
  MapShape shape = shape_of(skeleton);
  shape.chosen.mono_sessions = 2;
  const client::MapPicture picture = picture_of(shape, {{"dock", {point_at(100), point_at(55)}}});
  EXPECT_THAT(picture.subtitle, HasSubstr("101 keyframes, 12 loop closures"));
  EXPECT_EQ(picture.session_keyframes.at(1), 101u);
  EXPECT_EQ(picture.parts[0].keyframes, 101u);
  EXPECT_EQ(picture.alike.at(client::MapPicture::EdgeKind::kLoopAccepted), 11u);
  EXPECT_EQ(picture.mono_sessions, 2u);
  EXPECT_EQ(picture.labels.size(), 1u) << "55 is no point";
  EXPECT_THAT(shape_text(shape), HasSubstr("11 points stand for 101 keyframes"));
}

TEST(MapShape, OfARouteItsEndsAndTheEndsOfItsClosuresAreKept) {
  std::vector<FrameId> route;
  for (std::uint32_t i = 5; i <= 20; ++i) route.push_back(point_at(i));
  for (std::uint32_t i = 90; i >= 80; --i) route.push_back(point_at(i));
  route.push_back(point_at(7, 2));
  EXPECT_THAT(corners_of(route), ElementsAre(point_at(5), point_at(20), point_at(90), point_at(80), point_at(7, 2)));
  EXPECT_THAT(corners_of({point_at(1)}), ElementsAre(point_at(1)));
}

TEST(MapShape, ARouteIsInterruptedWhereASessionIsNotDrawn) {
  Skeleton skeleton = drive();
  MapShape shape = shape_of(skeleton);
  shape.chosen.sessions[1] = {};
  const std::vector<FrameId> route{point_at(10),   point_at(11),   point_at(20),
                                   point_at(7, 2), point_at(8, 2), point_at(50)};
  EXPECT_THAT(drawn_of(shape, route),
              ElementsAre(point_at(10), point_at(20), point_at(7, 2), point_at(8, 2), point_at(50)));
}

}  // namespace
}  // namespace relmap::cli
