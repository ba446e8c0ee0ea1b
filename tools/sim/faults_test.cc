#include "tools/sim/faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tools/sim/grey_levels_for_test.h"

namespace relmap::sim {
namespace {

PictureWorldOptions options_with(const std::string& faults, int frames = 140) {
  PictureWorldOptions options;
  options.frames = frames;
  options.camera = {.f = 200, .cx = 127.5, .cy = 95.5, .baseline = 0.2, .width = 256, .height = 192};
  EXPECT_TRUE(options.set_faults(faults).ok());
  EXPECT_TRUE(options.check().ok());
  return options;
}

TEST(Faults, AllHasOneOfEachKindAndDropsPairsAtAnyRate) {
  for (const double rate : {10.0, 25.0}) {
    PictureWorldOptions options;
    options.rate = rate;
    ASSERT_TRUE(options.set_faults("all").ok());
    ASSERT_TRUE(options.check().ok());
    EXPECT_EQ(options.drop_share, 0.05);
    std::set<FaultKind> kinds;
    for (const FaultEpisode& episode : options.faults) kinds.insert(episode.kind);
    EXPECT_EQ(kinds.size(), 8U);
    EXPECT_EQ(options.faults.size(), 8U);
    EXPECT_EQ(kinds.count(FaultKind::kLongBlack), 0U);
    EXPECT_LT(options.faults.back().end(rate), options.frames - 20);
  }
}

TEST(Faults, WhatCannotBeReadIsRefused) {
  for (const char* text : {"fog:10", "black", "black:", "black:x", "black:10x", "none:3", ":5", "black:10,,blur:40"})
    EXPECT_EQ(parse_faults(text, 650, 10).reason(), Reason::INVALID_ARGUMENT) << text;
  EXPECT_EQ(parse_faults("all", 60, 10).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_TRUE(parse_faults("black:10,blur:40", 650, 10).ok());
  EXPECT_EQ(check_faults({{FaultKind::kBlack, 10}, {FaultKind::kBlur, 19}}, 650, 10).reason(),
            Reason::INVALID_ARGUMENT);
  EXPECT_EQ(check_faults({{FaultKind::kBlack, 0}}, 650, 10).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_TRUE(check_faults({{FaultKind::kBlack, 10}, {FaultKind::kBlur, 20}}, 650, 10).ok());
}

TEST(Faults, LastAsLongAsTheirKind) {
  const PictureWorld world(options_with("black:20,swivel:40,one_eye:60,time_back:90,dropped:95"));
  const auto frames_of = [&](FaultKind kind) {
    std::vector<int> frames;
    for (int i = 0; i < world.options().frames; ++i)
      if (world.fault_at(i) == kind) frames.push_back(i);
    return frames;
  };
  EXPECT_EQ(frames_of(FaultKind::kBlack), (std::vector<int>{20, 21, 22, 23, 24, 25, 26, 27, 28, 29}));
  EXPECT_EQ(frames_of(FaultKind::kSwivel), (std::vector<int>{40, 41, 42, 43, 44}));
  EXPECT_EQ(frames_of(FaultKind::kOneEye).size(), 20U);
  EXPECT_EQ(frames_of(FaultKind::kTimeBack), std::vector<int>{90});
  EXPECT_EQ(frames_of(FaultKind::kDropped), std::vector<int>{95});
  EXPECT_EQ(world.faults().size(), 5U);
}

TEST(Faults, DropTheirShareOfPairsAndNoneThatOtherFaultsNeed) {
  PictureWorldOptions options;
  options.frames = 4000;
  ASSERT_TRUE(options.set_faults("all").ok());
  const sim::FaultSchedule schedule(options.faults, 0.3, options.rate, 1);
  int dropped = 0;
  for (int i = 0; i < options.frames; ++i) dropped += schedule.dropped(i) ? 1 : 0;
  EXPECT_NEAR(dropped, 1200, 90);
  EXPECT_FALSE(schedule.dropped(0));
  for (const FaultEpisode& e : options.faults) {
    if (e.end(options.rate) != e.begin + 1) continue;
    EXPECT_FALSE(schedule.dropped(e.begin - 1));
    EXPECT_EQ(schedule.at(e.begin), e.kind);
  }
}

TEST(Faults, BlackPicturesAreBlackInTheGivenEyes) {
  const PictureWorld world(options_with("black:20,one_eye:40,one_eye:70"));
  const auto brightness = [&](int i) {
    const StereoPictures pair = world.render(i);
    return std::pair(mean_grey(pair.left), mean_grey(pair.right));
  };
  for (const int i : {20, 29}) {
    EXPECT_LT(brightness(i).first, 3);
    EXPECT_GT(brightness(i).first, 0.2);  // it still has noise
    EXPECT_LT(brightness(i).second, 3);
  }
  EXPECT_GT(brightness(19).first, 50);
  EXPECT_GT(brightness(30).second, 50);
  EXPECT_GT(brightness(40).first, 50);
  EXPECT_LT(brightness(40).second, 3);
  EXPECT_LT(brightness(89).first, 3);
  EXPECT_GT(brightness(89).second, 50);
}

TEST(Faults, TheSwivelTurnsTheHeadOutAndBackSmoothly) {
  const PictureWorld world(options_with("swivel:40")), straight(options_with("none"));
  const auto turn = [&](double t) {
    return so3_log(straight.truth_at(t).R.transpose() * world.truth_at(t).R).y() * 180 / M_PI;
  };
  EXPECT_EQ(world.truth(40).t, straight.truth(40).t);
  EXPECT_NEAR(turn(4.25), 190 * 0.22, 0.1);
  EXPECT_NEAR(turn(4.15) - turn(4.1), 190 * 0.05, 0.01);
  EXPECT_NEAR(turn(4.4) - turn(4.35), -190 * 0.05, 0.01);
  EXPECT_NEAR(turn(4.5), 0, 1e-9);
  for (double t = 3.99; t < 4.52; t += 0.001) {
    const sim::Motion motion = world.motion_at(t);
    const double h = 1e-4;
    const SE3 before = world.truth_at(t - h), after = world.truth_at(t + h);
    EXPECT_LT((so3_log(before.R.transpose() * after.R) / (2 * h) - motion.angular_velocity).norm(), 0.01) << t;
    EXPECT_LT(((after.t - before.t) / (2 * h) - motion.velocity).norm(), 0.02) << t;
    const sim::Motion later = world.motion_at(t + h);
    EXPECT_LT(((later.angular_velocity - motion.angular_velocity) / h - motion.angular_acceleration).norm(), 2) << t;
    EXPECT_LT(((later.velocity - motion.velocity) / h - motion.acceleration).norm(), 0.5) << t;
  }
}

TEST(Faults, ADoubledPairHasThePixelsBeforeAndALaterTime) {
  const PictureWorld world(options_with("doubled:40"));
  EXPECT_EQ(world.render(40).left.pixels, world.render(39).left.pixels);
  EXPECT_EQ(world.render(40).right.pixels, world.render(39).right.pixels);
  EXPECT_NE(world.render(41).left.pixels, world.render(40).left.pixels);
  EXPECT_EQ(world.time_us(40) - world.time_us(39), 100'000);
}

TEST(Faults, TimeStampsGoWrongOnceAndAreRightAgain) {
  const PictureWorld world(options_with("time_back:40,time_ahead:60"));
  EXPECT_EQ(world.time_us(40) - world.time_us(39), -500'000);
  EXPECT_EQ(world.time_us(41) - world.time_us(39), 200'000);
  EXPECT_EQ(world.time_us(60) - world.time_us(59), 3'600'100'000);
  EXPECT_EQ(world.time_us(61) - world.time_us(59), 200'000);
}

TEST(Faults, TheMoverCoversAThirdOfThePictureAndCrossesIt) {
  const PictureWorld world(options_with("mover:40")), empty(options_with("none"));
  const StereoCamera& camera = world.options().camera;
  double first_column = 0, last_column = 0;
  for (const int i : {40, 55, 69}) {
    const std::vector<float> with = world.render_depth(i), without = empty.render_depth(i);
    int covered = 0;
    double column = 0, min_depth = 1e9, max_depth = 0;
    for (std::size_t k = 0; k < with.size(); ++k) {
      if (with[k] == without[k]) continue;
      ++covered;
      column += static_cast<double>(k % camera.width);
      min_depth = std::min<double>(min_depth, with[k]);
      max_depth = std::max<double>(max_depth, with[k]);
    }
    EXPECT_NEAR(covered / static_cast<double>(with.size()), 0.3, 0.08) << i;
    EXPECT_GT(min_depth, 1.9);
    EXPECT_LT(max_depth, 3.1);
    (i == 40 ? first_column : last_column) = column / covered;
  }
  EXPECT_NEAR(last_column - first_column, 0.5 * 2.9 / 2.5 * camera.f, 15);
  EXPECT_EQ(world.render_depth(70), empty.render_depth(70));
}

TEST(Faults, BlurIsAnExposureOf40Ms) {
  PictureWorldOptions blurred = options_with("none");
  blurred.exposure_s = 0.04;
  const PictureWorld world(options_with("blur:40")), reference(blurred), sharp(options_with("none"));
  EXPECT_EQ(world.render(45).left.pixels, reference.render(45).left.pixels);
  EXPECT_EQ(world.render(50).left.pixels, sharp.render(50).left.pixels);
}

}  // namespace
}  // namespace relmap::sim
