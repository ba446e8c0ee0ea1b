// Drives on which the robot is carried: what it sees meanwhile, and what is true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tools/sim/building_scene.h"
#include "tools/sim/carried_points_for_test.h"
#include "tools/sim/circuit.h"
#include "tools/sim/itinerary.h"
#include "tools/sim/picture_world.h"
#include "tools/sim/road.h"

namespace relmap::sim {
namespace {

PictureWorldOptions small_ride(RideKind kind, bool carried = true) {
  PictureWorldOptions options = ride_options(kind, 3, carried);
  options.camera = scaled(options.camera, 160);
  return options;
}

constexpr RideKind kCarrying[] = {RideKind::kLift, RideKind::kLiftAlike, RideKind::kLiftRamp, RideKind::kTrain,
                                  RideKind::kEscalator};

std::vector<int> frames_carried(const PictureWorld& world) {
  std::vector<int> frames;
  for (int i = 0; i < world.options().frames; ++i)
    if (world.carried(i)) frames.push_back(i);
  return frames;
}

// Of pixels that stand out from their neighbours in both directions, as features do: the share that is moving.
double moving_share_of_features(const PictureWorld& world, int frame) {
  const GreyPicture picture = world.render(frame).left;
  const std::vector<bool> moving = world.moving(frame);
  int features = 0, carried = 0;
  for (int v = 1; v + 1 < picture.height; ++v)
    for (int u = 1; u + 1 < picture.width; ++u) {
      const std::size_t at = static_cast<std::size_t>(v) * static_cast<std::size_t>(picture.width) + u;
      const auto row = static_cast<std::size_t>(picture.width);
      const int across = std::abs(picture.pixels[at + 1] - picture.pixels[at - 1]);
      const int down = std::abs(picture.pixels[at + row] - picture.pixels[at - row]);
      if (std::min(across, down) < 30) continue;
      ++features;
      carried += moving[at];
    }
  return static_cast<double>(carried) / features;
}

// Mean over the frames in which the robot is carried.
double moving_share(const PictureWorld& world) {
  double sum = 0, count = 0;
  const std::vector<int> frames = frames_carried(world);
  for (std::size_t k = 0; k < frames.size(); k += 6, ++count) sum += moving_share_of_features(world, frames[k]);
  return sum / count;
}

double difference(const GreyPicture& a, const GreyPicture& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.pixels.size(); ++k) sum += std::abs(a.pixels[k] - b.pixels[k]);
  return sum / static_cast<double>(a.pixels.size());
}

TEST(Ride, NamesAreParsedAsPrinted) {
  for (const RideKind kind : kCarrying) EXPECT_EQ(ride_of(ride_name(kind)), kind);
  EXPECT_FALSE(ride_of("ferry"));
}

TEST(Ride, OptionsThatContradictOneAnotherAreRefused) {
  for (const RideKind kind : kCarrying) EXPECT_TRUE(ride_options(kind, 1).check().ok()) << ride_name(kind);
  PictureWorldOptions street = ride_options(RideKind::kLift, 1);
  street.scene = SceneKind::kStreet;
  EXPECT_EQ(street.check().reason(), Reason::INVALID_ARGUMENT);
  PictureWorldOptions building;
  building.scene = SceneKind::kBuilding;
  EXPECT_EQ(building.check().reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(ride_options(RideKind::kLiftRamp, 1, false).check().reason(), Reason::INVALID_ARGUMENT);
}

TEST(Ride, EasedGoesFromZeroToOneWithoutAJump) {
  EXPECT_EQ(sim::eased(-1, 5, 1), 0);
  EXPECT_EQ(sim::eased(6, 5, 1), 1);
  EXPECT_DOUBLE_EQ(sim::eased(2.5, 5, 1), 0.5);
  for (double x = 0; x < 5; x += 0.01) {
    const double step = sim::eased(x + 0.01, 5, 1) - sim::eased(x, 5, 1);
    EXPECT_GE(step, 0);
    EXPECT_LE(step, 0.01 / 4 + 1e-12);
  }
}

// Nothing jumps, a robot that is carried does not drive, and the way that it is carried is in the truth.
TEST(Ride, TruthIsContinuousThroughEveryRide) {
  for (const RideKind kind : kCarrying) {
    const PictureWorld world(small_ride(kind));
    const double rate = world.options().rate;
    double carried = 0, max_step = 0;
    SE3 before = world.truth_at(0);
    for (int k = 1; k < 4 * world.options().frames; ++k) {
      const SE3 here = world.truth_at(k / rate / 4);
      const double step = (here.t - before.t).norm();
      max_step = std::max(max_step, step);
      if (world.carried(k / 4)) carried += step;
      before = here;
    }
    EXPECT_LT(max_step, 3.5 / rate / 4) << ride_name(kind) << ": no faster than the train";
    EXPECT_GT(carried, 3.5) << ride_name(kind);
  }
}

// The lift moves by four metres while the camera sees nothing move.
TEST(Ride, InALiftTheWorldStandsStill) {
  const PictureWorld world(small_ride(RideKind::kLiftRamp));
  const std::vector<int> frames = frames_carried(world);
  ASSERT_GT(frames.size(), 20u);
  const int first = frames.front(), last = frames.back();
  EXPECT_NEAR((world.truth(last).t - world.truth(first).t).norm(), sim::kStorey, 0.3);
  const double noise = difference(world.render(first).left, world.render(first + 1).left);
  EXPECT_LT(difference(world.render(first).left, world.render(last).left), 1.1 * noise);
  EXPECT_GT(difference(world.render(first).left, world.render(frames.front() - 35).left), 5 * noise);
}

TEST(Ride, LiftEndsWhereTheRampBegan) {
  const PictureWorld world(small_ride(RideKind::kLiftRamp));
  const int after = frames_carried(world).back() + 1;
  EXPECT_LT((world.truth(after).t - world.truth(0).t).norm(), 0.5);
  EXPECT_NEAR(world.truth(after - 60).t.y() - world.truth(after).t.y(), -sim::kStorey, 0.3);
}

TEST(Ride, WagonFillsAboutHalfOfTheView) {
  const double share = moving_share(PictureWorld(small_ride(RideKind::kTrain)));
  EXPECT_GT(share, 0.4);
  EXPECT_LT(share, 0.65);
}

TEST(Ride, OnAnEscalatorMostFeaturesMoveAlong) {
  EXPECT_GE(moving_share(PictureWorld(small_ride(RideKind::kEscalator))), 0.7);
}

// A ride that the robot does not take: it stands for as long, and then goes all the way itself.
TEST(Ride, OnFootNothingIsCarried) {
  for (const RideKind kind : {RideKind::kLift, RideKind::kTrain, RideKind::kEscalator}) {
    const PictureWorld ridden(small_ride(kind)), walked(small_ride(kind, false));
    EXPECT_TRUE(frames_carried(walked).empty()) << ride_name(kind);
    int waits = 0, rides = 0;
    for (int i = 0; i < walked.options().frames; ++i) waits += walked.riding(i);
    for (int i = 0; i < ridden.options().frames; ++i) rides += ridden.riding(i);
    EXPECT_NEAR(waits, rides, 2) << ride_name(kind);
  }
}

// By the depth of one frame its points are found in another one: what is drawn is where the truth has it.
TEST(Ride, BuildingStandsStillAroundTheTruth) {
  for (const RideKind kind : {RideKind::kLift, RideKind::kEscalator}) {
    const PictureWorld world(small_ride(kind));
    const CarriedPoints points = carry_points(world, 40, 44, 5);
    ASSERT_GT(points.visible, 300);
    EXPECT_GT(points.agree, 0.85 * points.visible) << ride_name(kind);
  }
}

// Of the textures in the scene's second half: the share that its first half has, too.
double repeated_share(RideKind kind) {
  const PictureWorldOptions options = ride_options(kind, 3);
  const sim::Circuit circuit(options.seed, options.circuit_length());
  const sim::Scene scene = sim::build_building(options, sim::Road(options, circuit));
  std::set<std::vector<float>> first;
  double second = 0, repeated = 0;
  for (std::size_t k = 0; k < scene.textures.size(); ++k) {
    std::vector<float> print;
    for (int n = 0; n < 40; ++n)
      print.push_back(scene.textures[k].sample(3.7F * static_cast<float>(n), 2.3F * static_cast<float>(n), 0));
    if (2 * k < scene.textures.size()) {
      first.insert(print);
    } else {
      ++second;
      repeated += first.contains(print) ? 1 : 0;
    }
  }
  return repeated / second;
}

TEST(Ride, FloorsAndHalvesLookAlikeExceptForAFewThings) {
  for (const RideKind kind : {RideKind::kLiftAlike, RideKind::kAlike}) {
    EXPECT_GT(repeated_share(kind), 0.8) << ride_name(kind);
    EXPECT_LT(repeated_share(kind), 0.97) << ride_name(kind);
  }
  EXPECT_EQ(repeated_share(RideKind::kLift), 0);
}

TEST(Ride, SeedMakesTheRide) {
  for (const RideKind kind : {RideKind::kLift, RideKind::kTrain, RideKind::kEscalator}) {
    const PictureWorld a(small_ride(kind)), b(small_ride(kind));
    const int frame = frames_carried(a)[10];
    EXPECT_EQ(a.render(frame).left.pixels, b.render(frame).left.pixels) << ride_name(kind);
    EXPECT_EQ(a.truth(frame).t, b.truth(frame).t);
  }
}

}  // namespace
}  // namespace relmap::sim
