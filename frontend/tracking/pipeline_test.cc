#include "frontend/tracking/pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/session_for_test.h"
#include "frontend/tracking/stamps.h"
#include "tools/sim/picture_world.h"

namespace relmap::tracking {
namespace {

constexpr int kPairs = 12;

sim::PictureWorldOptions world_options() {
  sim::PictureWorldOptions options;
  options.seed = 12;
  options.step = 0.4;
  options.frames = 120;
  options.camera = {.f = 250, .cx = 159.5, .cy = 119.5, .baseline = 0.12, .width = 320, .height = 240};
  return options;
}

// A short drive down a rendered street.
const std::vector<CapturedPair>& drive() {
  static const std::vector<CapturedPair> pairs = [] {
    cv::setNumThreads(1);  // ThreadSanitizer does not see how OpenCV's own threads keep out of each other's way
    const sim::PictureWorld world(world_options());
    const auto copy = [](const sim::GreyPicture& picture) {
      vision::Image image(picture.width, picture.height);
      std::copy(picture.pixels.begin(), picture.pixels.end(), image.row(0));
      return image;
    };
    std::vector<CapturedPair> rendered;
    for (int i = 0; i < kPairs; ++i) {
      const sim::StereoPictures pictures = world.render(i);
      CapturedPair& pair = rendered.emplace_back();
      pair.left = copy(pictures.left);
      pair.right = copy(pictures.right);
      pair.time_us = world.time_us(i);
      pair.index = static_cast<std::uint64_t>(i);
      pair.picture = std::to_string(i) + ".png";
    }
    return rendered;
  }();
  return pairs;
}

SessionHeader short_drive_session() { return testing_session::session_of(world_options().camera); }

// Of pictures that are rectified already; a baseline of 0: of one eye.
vision::Rectifier rectifier_of(double baseline) {
  const StereoCamera camera = world_options().camera;
  StereoCalibration calibration;
  calibration.left = {.fx = camera.f, .fy = camera.f, .cx = camera.cx, .cy = camera.cy};
  if (baseline > 0) calibration.right = calibration.left;
  calibration.T_right_left.t = {-baseline, 0, 0};
  calibration.rectified = true;
  return vision::Rectifier::make(calibration, camera.width, camera.height).or_throw();
}

const vision::Rectifier& rectifier() {
  static const vision::Rectifier made = rectifier_of(world_options().camera.baseline);
  return made;
}

// The next of `pairs` at each call, then the end.
auto giving(std::vector<CapturedPair> pairs) {
  return [pairs = std::move(pairs), next = std::size_t{0}]() mutable -> Result<std::optional<CapturedPair>> {
    if (next == pairs.size()) return std::optional<CapturedPair>();
    return std::optional<CapturedPair>(pairs[next++]);
  };
}

// Without pictures: for the first JPEG OpenCV loads GDAL, in whose locks ThreadSanitizer finds a wrong order.
PipelineOptions lean_options() {
  PipelineOptions options;
  options.appearance = 40;
  options.picture = KeyframePicture::kNone;
  return options;
}

struct Ran {
  Status status;
  PipelineSummary summary;
  std::vector<Bytes> keyframes;
  std::vector<std::int64_t> times;
  std::vector<PairReport> reports;
  std::vector<Reason> refused;
  std::vector<std::string> messages;  // of those refused
  std::vector<std::pair<std::uint64_t, std::string>> names;
};

Ran run(std::function<Result<std::optional<CapturedPair>>()> capture, const PipelineOptions& options = lean_options()) {
  Ran ran;
  StereoTracker tracker(short_drive_session());
  Pipeline pipeline(tracker, rectifier(),
                    {.capture = std::move(capture),
                     .before_tracking = {},
                     .publish =
                         [&](TrackedPair& pair) {
                           ran.times.push_back(pair.time_us);
                           ran.reports.push_back(pair.report);
                           ran.names.emplace_back(pair.index, pair.picture);
                           if (pair.keyframe) ran.keyframes.push_back(encode_keyframe(*pair.keyframe));
                           return Status();
                         },
                     .refused =
                         [&](const Status& status) {
                           ran.refused.push_back(status.reason());
                           ran.messages.push_back(status.message());
                         }},
                    options);
  ran.status = pipeline.run();
  ran.summary = pipeline.summary();
  return ran;
}

std::vector<Bytes> one_thread(const std::vector<CapturedPair>& pairs, const PipelineOptions& options = lean_options()) {
  std::vector<Bytes> keyframes;
  StereoTracker tracker(short_drive_session());
  for (const CapturedPair& captured : pairs) {
    const auto pair = prepare_pair(captured.left, captured.right);
    auto keyframe = tracker.feed(pair, captured.time_us).or_throw();
    if (!keyframe) continue;
    keyframe->appearance = appearance_set(*pair, *keyframe, tracker.report().offset_px, options.appearance);
    keyframe->picture = keyframe_picture(pair->picture, options.picture);
    keyframes.push_back(encode_keyframe(*keyframe));
  }
  return keyframes;
}

TEST(Pipeline, GivesTheSameBytesAsOneThread) {
  for (const std::size_t waiting : {1u, 4u}) {
    PipelineOptions options = lean_options();
    options.waiting = waiting;
    const Ran ran = run(giving(drive()), options);
    EXPECT_TRUE(ran.status.ok()) << ran.status.to_string();
    EXPECT_EQ(ran.summary.tracked, drive().size());
    EXPECT_GE(ran.keyframes.size(), 3u);
    EXPECT_EQ(ran.keyframes, one_thread(drive()));
    EXPECT_EQ(ran.summary.keyframes.count(), ran.keyframes.size());
    EXPECT_EQ(ran.summary.tracking.count(), ran.summary.tracked);
    EXPECT_GT(ran.summary.tracking.quantile(0.5), 0);
    EXPECT_GT(ran.summary.keyframes.quantile(0.5), 0);
    EXPECT_LE(ran.summary.keyframes.quantile(0.5), ran.summary.keyframes.quantile(0.99));
    EXPECT_TRUE(ran.refused.empty());
  }
}

// This is a separate suite, because ThreadSanitizer does not run it.
TEST(KeyframePictures, AreTheSameBytesAsOfOneThread) {
  for (const KeyframePicture picture : {KeyframePicture::kSmall, KeyframePicture::kWhole}) {
    PipelineOptions options = lean_options();
    options.picture = picture;
    const Ran ran = run(giving(drive()), options);
    EXPECT_GE(ran.keyframes.size(), 3u);
    EXPECT_EQ(ran.keyframes, one_thread(drive(), options));
    EXPECT_NE(ran.keyframes, one_thread(drive()));
  }
}

TEST(Pipeline, BadPairsAreCountedAndTheRunGoesOn) {
  std::vector<CapturedPair> pairs = drive();
  for (const std::size_t i : {3u, 5u}) pairs[i].left = pairs[i].right = vision::Image(100, 50);
  pairs[7].time_us = pairs[2].time_us;
  pairs[9].time_us += 3'600'000'000;
  auto give = giving(pairs);
  const Ran ran = run([&, calls = 0]() mutable -> Result<std::optional<CapturedPair>> {
    if (++calls == 2) return {Reason::PICTURE_DAMAGED, "000001.png"};
    return give();
  });
  EXPECT_TRUE(ran.status.ok()) << ran.status.to_string();
  const std::map<Reason, std::uint64_t> expected = {
      {Reason::PICTURE_DAMAGED, 1}, {Reason::BAD_SIZE, 2}, {Reason::TIME_BACKWARDS, 1}, {Reason::TIME_AHEAD, 1}};
  EXPECT_EQ(ran.summary.refused, expected);
  EXPECT_EQ(ran.refused.size(), 5u);
  EXPECT_EQ(ran.summary.tracked, drive().size() - 4);
  for (std::size_t i = 1; i < ran.reports.size(); ++i) EXPECT_TRUE(ran.reports[i].tracked) << i;

  const auto told = [&](std::initializer_list<std::string> words) {
    return std::count_if(ran.messages.begin(), ran.messages.end(), [&](const std::string& message) {
      return std::all_of(words.begin(), words.end(), [&](const auto& word) { return message.find(word) != word.npos; });
    });
  };
  const auto stamp = [&](std::size_t i) { return std::to_string(pairs[i].time_us) + " us"; };
  EXPECT_EQ(told({"pair 3 (3.png): "}), 1);
  EXPECT_EQ(told({"pair 7 (7.png): ", stamp(7), stamp(6)}), 1) << "its stamp, and that of the last good one";
  EXPECT_EQ(told({"pair 9 (9.png): ", stamp(9), stamp(8)}), 1);
}

TEST(Pipeline, PairsKeepTheirIndexAndPicture) {
  std::vector<CapturedPair> pairs = drive();
  pairs.erase(pairs.begin() + 1, pairs.begin() + 3);
  const Ran ran = run(giving(pairs));
  ASSERT_EQ(ran.names.size(), pairs.size());
  EXPECT_EQ(ran.names[0], std::pair(std::uint64_t{0}, std::string("0.png")));
  EXPECT_EQ(ran.names[1], std::pair(std::uint64_t{3}, std::string("3.png")));
}

TEST(Pipeline, PairsOfOneEyeAreTracked) {
  std::vector<CapturedPair> pairs = drive();
  pairs[5].right = vision::Image();
  pairs[7].left = vision::Image();
  const Ran ran = run(giving(pairs));
  EXPECT_TRUE(ran.refused.empty());
  ASSERT_EQ(ran.reports.size(), pairs.size());
  for (const std::size_t i : {5u, 7u}) {
    EXPECT_TRUE(ran.reports[i].tracked) << i;
    EXPECT_TRUE(ran.reports[i].one_eye) << i;
  }
  EXPECT_FALSE(ran.reports[8].one_eye);
}

TEST(Pipeline, AMissingEyeIsCountedAndItsPairTrackedByTheOther) {
  std::vector<CapturedPair> pairs = drive();
  pairs[4].right = vision::Image();
  pairs[4].eye_missing = {Reason::PICTURE_DAMAGED, "000004.png"};
  pairs[6].left = vision::Image();
  pairs[6].eye_missing = {Reason::NO_SUCH_FILE, "000006.png"};
  pairs[8].left = vision::Image(100, 50);
  pairs[9].right = vision::Image(100, 50);
  const Ran ran = run(giving(pairs));
  const std::map<Reason, std::uint64_t> expected = {
      {Reason::PICTURE_DAMAGED, 1}, {Reason::NO_SUCH_FILE, 1}, {Reason::BAD_SIZE, 2}};
  EXPECT_EQ(ran.summary.refused, expected);
  EXPECT_EQ(ran.refused.size(), 4u);
  ASSERT_EQ(ran.reports.size(), pairs.size());
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    EXPECT_TRUE(ran.reports[i].tracked) << i;
    EXPECT_EQ(ran.reports[i].one_eye, i == 4 || i == 6 || i == 8 || i == 9) << i;
  }
}

// A run that began with one eye would have to start anew, with a guessed step, when the second eye comes.
TEST(Pipeline, ARunBeginsWithBothEyes) {
  std::vector<CapturedPair> pairs = drive();
  pairs[0].left = vision::Image();
  pairs[0].eye_missing = {Reason::PICTURE_DAMAGED, "000000.png"};
  pairs[1].right = vision::Image(100, 50);
  const Ran ran = run(giving(pairs));
  EXPECT_EQ(ran.refused, (std::vector{Reason::PICTURE_DAMAGED, Reason::BAD_SIZE}));
  ASSERT_EQ(ran.times.size(), pairs.size() - 2);
  EXPECT_EQ(ran.times.front(), pairs[2].time_us);
  for (std::size_t i = 1; i < ran.reports.size(); ++i) EXPECT_TRUE(ran.reports[i].tracked) << i;
}

TEST(Pipeline, TheOldestWaitingPairIsDroppedIfTheSourceCannotWait) {
  PipelineOptions options = lean_options();
  options.waiting = 2;
  options.drop_oldest = true;
  const Ran ran = run(giving(drive()), options);  // faster than any tracking
  EXPECT_TRUE(ran.status.ok());
  EXPECT_GT(ran.summary.dropped, 0u);
  EXPECT_EQ(ran.summary.dropped + ran.summary.tracked, drive().size());
  EXPECT_EQ(ran.times.back(), drive().back().time_us);
  EXPECT_TRUE(std::is_sorted(ran.times.begin(), ran.times.end()));
}

TEST(Pipeline, ARunThatGoesOnTakesTheLastKeyframesOwnPairAndNoneBefore) {
  PipelineOptions options = lean_options();
  options.stamps = StampFilter(drive()[4].time_us - 1);
  const Ran ran = run(giving(drive()), options);
  EXPECT_EQ(ran.summary.refused.at(Reason::TIME_BACKWARDS), 4u);
  EXPECT_EQ(ran.times.front(), drive()[4].time_us);
}

TEST(Pipeline, TheGyroIsFedBeforeEachPair) {
  std::vector<std::int64_t> fed;
  StereoTracker tracker(short_drive_session());
  Pipeline pipeline(tracker, rectifier(),
                    {.capture = giving({drive()[0], drive()[1], drive()[2]}),
                     .before_tracking = [&](StereoTracker&, std::int64_t time_us) { fed.push_back(time_us); },
                     .publish = [](TrackedPair&) { return Status(); },
                     .refused = {}},
                    lean_options());
  EXPECT_TRUE(pipeline.run().ok());
  EXPECT_EQ(fed, (std::vector{drive()[0].time_us, drive()[1].time_us, drive()[2].time_us}));
}

TEST(Pipeline, OneEyedCamerasAreRefused) {
  const vision::Rectifier mono = rectifier_of(0);
  StereoTracker tracker(short_drive_session());
  Pipeline pipeline(
      tracker, mono,
      {.capture = giving({}), .before_tracking = {}, .publish = [](TrackedPair&) { return Status(); }, .refused = {}});
  EXPECT_EQ(pipeline.run().reason(), Reason::NOT_STEREO);
}

TEST(Pipeline, PublishingThatFailsEndsTheRun) {
  StereoTracker tracker(short_drive_session());
  int published = 0;
  Pipeline pipeline(
      tracker, rectifier(),
      {.capture = [&]() -> Result<std::optional<CapturedPair>> {
         static std::int64_t time_us = 1'600'000'000'000'000;  // it would never end
         CapturedPair pair = drive()[0];
         pair.time_us = time_us += 100'000;
         return std::optional(std::move(pair));
       },
       .before_tracking = {},
       .publish = [&](TrackedPair&) { return ++published < 3 ? Status() : Status(Reason::DISK_FULL, "no room"); },
       .refused = {}},
      lean_options());
  EXPECT_EQ(pipeline.run().reason(), Reason::DISK_FULL);
  EXPECT_EQ(published, 3);
}

TEST(Pipeline, ExceptionsOfAStageAreRethrown) {
  const auto throws = [](PipelineStages stages) {
    StereoTracker tracker(short_drive_session());
    Pipeline pipeline(tracker, rectifier(), std::move(stages), lean_options());
    EXPECT_THROW((void)pipeline.run(), std::runtime_error);
  };
  const auto publish = [](TrackedPair&) { return Status(); };
  throws({.capture = []() -> Result<std::optional<CapturedPair>> { throw std::runtime_error("capture"); },
          .before_tracking = {},
          .publish = publish,
          .refused = {}});
  throws({.capture = giving(drive()),
          .before_tracking = [](StereoTracker&, std::int64_t) { throw std::runtime_error("tracking"); },
          .publish = publish,
          .refused = {}});
  throws({.capture = giving(drive()),
          .before_tracking = {},
          .publish = [](TrackedPair&) -> Status { throw std::runtime_error("publishing"); },
          .refused = {}});
}

}  // namespace
}  // namespace relmap::tracking
