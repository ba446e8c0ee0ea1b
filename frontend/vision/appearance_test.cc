#include "frontend/vision/appearance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace relmap::vision {
namespace {

cv::Mat texture(int width, int height, std::uint64_t seed = 1) {
  cv::Mat sum(height, width, CV_32F, cv::Scalar(0));
  cv::RNG random(seed);
  for (const double blur : {1.5, 3.0, 6.0, 12.0}) {
    cv::Mat noise(height, width, CV_32F);
    random.fill(noise, cv::RNG::NORMAL, 0, 1);
    cv::GaussianBlur(noise, noise, {}, blur);
    sum += noise * blur;
  }
  cv::Mat grey;
  cv::normalize(sum, grey, 0, 255, cv::NORM_MINMAX, CV_8U);
  return grey;
}

ImageView view(const cv::Mat& m) { return {m.data, m.cols, m.rows, static_cast<int>(m.step)}; }

int distance(const AppearanceFeature& a, const AppearanceFeature& b) {
  int sum = 0;
  for (std::size_t i = 0; i < 128; ++i)
    sum += (a.descriptor[i] - b.descriptor[i]) * (a.descriptor[i] - b.descriptor[i]);
  return sum;
}

TEST(Appearance, GivesAsManyAsAskedSpreadOverThePicture) {
  const cv::Mat picture = texture(512, 384);
  const auto features = detect_appearance(view(picture));
  ASSERT_EQ(features.size(), 300u);
  int quarters[4] = {};
  for (const auto& f : features) {
    EXPECT_GE(f.u, 0);
    EXPECT_LT(f.u, 512);
    EXPECT_GE(f.v, 0);
    EXPECT_LT(f.v, 384);
    EXPECT_GT(f.scale, 0);
    EXPECT_TRUE(std::isnan(f.disparity));
    EXPECT_EQ(f.track, -1);
    ++quarters[(f.u > 256) + 2 * (f.v > 192)];
  }
  for (const int count : quarters) EXPECT_GT(count, 45);
}

TEST(Appearance, IsTheSameTwice) {
  const cv::Mat picture = texture(400, 300);
  const auto a = detect_appearance(view(picture)), b = detect_appearance(view(picture));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].u, b[i].u);
    EXPECT_EQ(a[i].v, b[i].v);
    EXPECT_EQ(a[i].descriptor, b[i].descriptor);
  }
}

// Both bases of the detector, halved and whole, must put a blob where it is.
TEST(Appearance, KeypointsLieWhereTheBlobsAre) {
  for (const int wanted : {1, 5000}) {
    for (const auto& [u, v] : {std::pair{200.0, 150.0}, std::pair{131.3, 97.6}}) {
      cv::Mat picture(300, 400, CV_8U);
      for (int y = 0; y < picture.rows; ++y)
        for (int x = 0; x < picture.cols; ++x)
          picture.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
              40 + 180 * std::exp(-((x - u) * (x - u) + (y - v) * (y - v)) / (2 * 5.0 * 5.0)));
      const auto features = detect_appearance(view(picture), wanted);
      ASSERT_GE(features.size(), 1u);
      EXPECT_NEAR(features[0].u, u, 0.1) << wanted;
      EXPECT_NEAR(features[0].v, v, 0.1) << wanted;
      EXPECT_NEAR(features[0].scale, 2 * 5.0, 2.0);
    }
  }
}

TEST(Appearance, MatchesAcrossATurnAndAScale) {
  const cv::Mat picture = texture(512, 384);
  const cv::Mat A = cv::getRotationMatrix2D({256, 192}, 25, 0.8);
  cv::Mat turned;
  cv::warpAffine(picture, turned, A, picture.size(), cv::INTER_AREA, cv::BORDER_REFLECT);
  const auto a = detect_appearance(view(picture), 400), b = detect_appearance(view(turned), 400);
  int right = 0, matched = 0;
  for (const auto& f : a) {
    const auto best = std::min_element(b.begin(), b.end(),
                                       [&](const auto& x, const auto& y) { return distance(f, x) < distance(f, y); });
    int second = std::numeric_limits<int>::max();
    for (const auto& other : b)
      if (&other != &*best) second = std::min(second, distance(f, other));
    if (distance(f, *best) > 0.6 * second) continue;
    ++matched;
    const double u = A.at<double>(0, 0) * f.u + A.at<double>(0, 1) * f.v + A.at<double>(0, 2);
    const double v = A.at<double>(1, 0) * f.u + A.at<double>(1, 1) * f.v + A.at<double>(1, 2);
    right += std::hypot(u - best->u, v - best->v) < 2;
  }
  EXPECT_GT(matched, 60);
  EXPECT_GT(right, 0.95 * matched);
}

TEST(Appearance, TrackedPositionsKeepOrderPlaceAndName) {
  const cv::Mat picture = texture(512, 384);
  const std::vector<TrackedPosition> tracked{{100.25F, 80.5F, 0, 3}, {0, 0, 2, 4}, {511, 383, 1, 5}, {300, 200, 3, 6}};
  const auto features = describe_tracked(view(picture), tracked);
  ASSERT_EQ(features.size(), tracked.size());
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    EXPECT_EQ(features[i].u, tracked[i].u);
    EXPECT_EQ(features[i].v, tracked[i].v);
    EXPECT_EQ(features[i].track, tracked[i].track);
    EXPECT_FLOAT_EQ(features[i].scale, 5.0F * static_cast<float>(1 << tracked[i].level));
    EXPECT_GT(std::count_if(features[i].descriptor.begin(), features[i].descriptor.end(), [](auto d) { return d > 0; }),
              20);
  }
}

// The descriptor of a tracked position must mean what the detector's mean: at a keypoint's place and sigma they agree.
TEST(Appearance, TrackedDescriptorsAgreeWithDetectedOnes) {
  const cv::Mat picture = texture(512, 384);
  int near = 0, close = 0;
  const auto detected = detect_appearance(view(picture), 1000);
  for (const auto& f : detected) {
    if (std::abs(f.scale - 5.0F) > 0.5F || f.u < 40 || f.v < 40 || f.u > 470 || f.v > 340) continue;
    const TrackedPosition position{f.u, f.v, 0, 0};
    const auto described = describe_tracked(view(picture), {&position, 1});
    ++near;
    close += distance(f, described[0]) < 150 * 150;
  }
  ASSERT_GT(near, 5);
  EXPECT_GT(close, 0.7 * near);  // the others have a second direction as strong
}

TEST(Appearance, TheWholeSetIsTrackedThenDetected) {
  const cv::Mat picture = texture(512, 384);
  std::vector<TrackedPosition> tracked;
  for (int i = 0; i < 120; ++i)
    tracked.push_back({static_cast<float>(20 + (i % 12) * 40), static_cast<float>(20 + (i / 12) * 35), i % 3,
                       static_cast<std::int16_t>(i)});
  const auto all = detect_appearance(view(picture), tracked, 300);
  ASSERT_EQ(all.size(), 300u);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i].track, i < 120 ? static_cast<int>(i) : -1);
}

TEST(Appearance, TakesFlatAndTinyPictures) {
  const cv::Mat flat(200, 300, CV_8U, cv::Scalar(90));
  EXPECT_TRUE(detect_appearance(view(flat)).empty());
  const cv::Mat tiny = texture(12, 12);
  EXPECT_TRUE(detect_appearance(view(tiny)).empty());
  EXPECT_TRUE(detect_appearance({}).empty());
  for (const int side : {16, 17, 24, 33, 64}) {
    const cv::Mat small = texture(side, side + 3);
    EXPECT_LE(detect_appearance(view(small)).size(), 300u);
    const TrackedPosition position{8, 8, 7, 0};
    EXPECT_EQ(describe_tracked(view(small), {&position, 1}).size(), 1u);
  }
}

}  // namespace
}  // namespace relmap::vision
