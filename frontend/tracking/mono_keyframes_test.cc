#include "frontend/tracking/mono_keyframes.h"

#include <gtest/gtest.h>

#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "frontend/vision/picture_appearance.h"

namespace relmap::tracking {
namespace {

constexpr int kWidth = 320, kHeight = 240;

vision::Image textured(int seed) {
  cv::Mat picture(kHeight, kWidth, CV_8UC1);
  cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
  random.fill(picture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(picture, picture, {}, 2);
  cv::normalize(picture, picture, 0, 255, cv::NORM_MINMAX);
  vision::Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) std::copy_n(picture.ptr<std::uint8_t>(y), kWidth, image.row(y));
  return image;
}

class MonoKeyframes : public testing::Test {
 protected:
  MonoKeyframes() {
    StereoCalibration calibration;
    calibration.left = {300, 300, 159.5, 119.5, 0, 0, 0, 0, 0};
    calibration.rectified = true;
    rectifier_.emplace(vision::Rectifier::make(calibration, kWidth, kHeight).or_throw());
    session_.uuid.bytes[0] = 1;
    session_.robot = "phone";
    session_.name = "tower";
    session_.camera = rectifier_->camera();
  }

  // Pictures, and errors where there is none.
  void feed(std::vector<Result<CapturedPair>> pictures, const MonoOptions& options = {}) {
    std::size_t next = 0;
    MonoStages stages;
    stages.capture = [&]() -> Result<std::optional<CapturedPair>> {
      if (next == pictures.size()) return std::optional<CapturedPair>();
      auto& picture = pictures[next++];
      if (!picture.ok()) return picture.status();
      return std::optional(std::move(*picture));
    };
    stages.refused = [&](const Status& status) { ++refused_[status.reason()]; };
    stages.publish = [&](MonoPicture& picture) {
      max_in_work_ = std::max(max_in_work_, next - keyframes_.size());
      keyframes_.push_back(picture.keyframe);
      return published_;
    };
    ended_ = run_mono(*rectifier_, session_, stages, options);
  }
  static CapturedPair picture(int number, vision::Image image) {
    CapturedPair captured;
    captured.left = std::move(image);
    captured.time_us = 1'600'000'000'000'000 + number * 3'600'000'000LL;
    captured.index = static_cast<std::uint64_t>(number);
    captured.picture = std::to_string(number) + ".jpg";
    return captured;
  }

  std::optional<vision::Rectifier> rectifier_;
  SessionHeader session_;
  std::vector<Keyframe> keyframes_;
  std::map<Reason, int> refused_;
  std::size_t max_in_work_ = 0;
  Status published_, ended_;
};

TEST_F(MonoKeyframes, HaveAnAppearanceAndNothingElse) {
  feed({picture(0, textured(0)), picture(1, textured(1))});
  ASSERT_EQ(keyframes_.size(), 2u);
  for (std::uint32_t i = 0; i < 2; ++i) {
    const Keyframe& keyframe = keyframes_[i];
    EXPECT_TRUE(check_keyframe(keyframe).ok()) << check_keyframe(keyframe).to_string();
    EXPECT_EQ(keyframe.sequence, i);
    EXPECT_EQ(keyframe.source, MotionSource::kStart);
    EXPECT_TRUE(keyframe.tracks.empty());
    EXPECT_FALSE(keyframe.picture.empty());
    const auto asked = vision::picture_appearance(textured(static_cast<int>(i)));
    ASSERT_EQ(keyframe.appearance.size(), asked.size()) << "as a question is described";
    EXPECT_EQ(keyframe.appearance.front().descriptor, asked.front().descriptor);
  }
}

TEST_F(MonoKeyframes, KeepTheOrderHoweverManyAreDescribedAtOnce) {
  std::vector<std::vector<Keyframe>> runs;
  for (const unsigned threads : {1U, 5U}) {
    std::vector<Result<CapturedPair>> pictures;
    for (int i = 0; i < 12; ++i) pictures.emplace_back(picture(i, textured(i)));
    MonoOptions options;
    options.threads = threads;
    keyframes_.clear();
    feed(std::move(pictures), options);
    ASSERT_EQ(keyframes_.size(), 12u);
    runs.push_back(keyframes_);
  }
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(encode_keyframe(runs[0][i]), encode_keyframe(runs[1][i])) << i;
}

// Each picture takes memory while it is described.
TEST_F(MonoKeyframes, TheNumberDescribedAtOnceIsBoundedOnAnyMachine) {
  std::vector<Result<CapturedPair>> pictures;
  for (int i = 0; i < 3 * static_cast<int>(kMaxDescribedAtOnce); ++i) pictures.emplace_back(picture(i, textured(i)));
  MonoOptions options;
  options.threads = 64;
  feed(std::move(pictures), options);
  EXPECT_EQ(keyframes_.size(), 3 * kMaxDescribedAtOnce);
  EXPECT_EQ(max_in_work_, kMaxDescribedAtOnce);
}

TEST_F(MonoKeyframes, UnusablePicturesAreLeftOutByName) {
  std::vector<Result<CapturedPair>> pictures;
  pictures.emplace_back(picture(0, textured(0)));
  pictures.emplace_back(Status(Reason::PICTURE_DAMAGED, "1.jpg"));
  pictures.emplace_back(picture(2, vision::Image(kWidth, kHeight)));  // black
  pictures.emplace_back(picture(0, textured(3)));
  pictures.emplace_back(picture(4, vision::Image(kWidth, kHeight / 2)));
  pictures.emplace_back(picture(5, textured(5)));
  feed(std::move(pictures));
  EXPECT_TRUE(ended_.ok());
  ASSERT_EQ(keyframes_.size(), 2u);
  EXPECT_EQ(keyframes_[1].sequence, 1u);
  const std::map<Reason, int> expected{
      {Reason::PICTURE_DAMAGED, 1}, {Reason::TOO_FEW_FEATURES, 1}, {Reason::TIME_BACKWARDS, 1}, {Reason::BAD_SIZE, 1}};
  EXPECT_EQ(refused_, expected);
}

TEST_F(MonoKeyframes, ContinueAnInterruptedSession) {
  MonoOptions options;
  options.first_sequence = 7;
  options.resumed_us = picture(0, {}).time_us;
  feed({picture(0, textured(0)), picture(1, textured(1))}, options);
  ASSERT_EQ(keyframes_.size(), 1u);
  EXPECT_EQ(keyframes_[0].sequence, 7u);
}

TEST_F(MonoKeyframes, EndWhenPublishingFails) {
  published_ = Status(Reason::IO_ERROR, "no room");
  std::vector<Result<CapturedPair>> pictures;
  for (int i = 0; i < 6; ++i) pictures.emplace_back(picture(i, textured(i)));
  feed(std::move(pictures));
  EXPECT_EQ(ended_.reason(), Reason::IO_ERROR);
  EXPECT_EQ(keyframes_.size(), 1u);
}

}  // namespace
}  // namespace relmap::tracking
