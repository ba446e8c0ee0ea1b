#include "frontend/vision/rig_check.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <utility>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::paint;
using testing_textures::Waves;

constexpr int kEyeWidth = 400, kEyeHeight = 300;
const StereoCamera kCheckedRig{300, 199.5, 149.5, 0.12, kEyeWidth, kEyeHeight};

// A slanted wall with disparities of 8 to 16 pixels, another piece of it each time. What the right eye sees lies
// `rows(u, v)` further down.
template <typename Rows>
std::pair<Image, Image> look(unsigned seed, const Rows& rows) {
  const Waves waves(seed, 6, 60);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  Image left = paint(kEyeWidth, kEyeHeight, [&](int x, int y) { return waves.at(x, y) + noise(random); });
  Image right = paint(kEyeWidth, kEyeHeight, [&](int x, int y) {
    const double u = (x + 8) / 0.98;  // u_right = u - (8 + 0.02 u)
    return 10 + 0.9 * waves.at(u, y - rows(u, y)) + noise(random);
  });
  return {std::move(left), std::move(right)};
}
std::pair<Image, Image> look(unsigned seed) {
  return look(seed, [](double, double) { return 0; });
}

void blur(Image& picture, double sigma) {
  cv::Mat pixels(picture.height(), picture.width(), CV_8UC1, picture.row(0));
  cv::GaussianBlur(pixels, pixels, {}, sigma);
}

// A report of three pairs, changed before they are looked at.
template <typename Change>
RigReport report_of(Change change) {
  RigCheck check;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::pair<Image, Image> pair = look(seed);
    change(pair);
    EXPECT_TRUE(check.add(pair.first, pair.second).ok());
  }
  return check.report();
}
template <typename Rows>
RigReport report_of_rows(const Rows& rows) {
  return report_of([&, seed = 0U](auto& pair) mutable { pair = look(++seed, rows); });
}

std::vector<Reason> reasons(const RigReport& report) {
  std::vector<Reason> reasons;
  for (const Status& finding : report.findings) reasons.push_back(finding.reason());
  return reasons;
}
std::vector<Reason> only(Reason reason) { return {reason}; }

TEST(RigCheck, AGoodOnePasses) {
  const RigReport report = report_of([](auto&) {});
  EXPECT_TRUE(report.findings.empty()) << report.findings[0].to_string();
  EXPECT_EQ(report.pairs, 3);
  EXPECT_GE(report.matches, 200);
  EXPECT_LT(report.row_error, 0.1);
  EXPECT_LT(report.row_error_90, 0.3);
  EXPECT_NEAR(report.row_offset, 0, 0.05);
  EXPECT_NEAR(report.disparity, 12, 1);
  EXPECT_GT(report.positive_disparity, 0.99);
  EXPECT_LT(*report.left.edge_width, 4);
  EXPECT_NEAR(*report.right.edge_width, *report.left.edge_width, 0.2);
}

TEST(RigCheck, NoPairsGiveNoFindings) {
  const RigReport report = RigCheck().report();
  EXPECT_EQ(report.pairs, 0);
  EXPECT_TRUE(report.findings.empty());
}

TEST(RigCheck, RowsThatAreApartAreMeasuredWithTheirSign) {
  const RigReport report = report_of_rows([](double, double) { return 2; });
  EXPECT_EQ(reasons(report), only(Reason::ROWS_APART));
  EXPECT_NEAR(report.row_error, 2, 0.1);
  EXPECT_NEAR(report.row_offset, 2, 0.1);
  EXPECT_NEAR(report.row_slope_x, 0, 0.1);
  EXPECT_NEAR(report_of_rows([](double, double) { return -2; }).row_offset, -2, 0.1);
}

TEST(RigCheck, LessThanAPixelIsNotApart) {
  const RigReport report = report_of_rows([](double, double) { return 0.7; });
  EXPECT_TRUE(report.findings.empty());
  EXPECT_NEAR(report.row_error, 0.7, 0.1);
}

TEST(RigCheck, RowsThreePixelsApartAreNotTakenForTooFewFeatures) {
  EXPECT_EQ(reasons(report_of_rows([](double, double) { return 3; })), only(Reason::ROWS_APART));
  EXPECT_EQ(reasons(report_of_rows([](double, double) { return -3; })), only(Reason::ROWS_APART));
}

// About its vertical axis, by rows alone: all is as far away as before.
RigReport report_of_yaw(double degrees, const std::optional<StereoCamera>& camera) {
  RigCheck check(camera);
  const double f = kCheckedRig.f, angle = degrees * M_PI / 180;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const auto [left, right] =
        look(seed, [&](double u, double v) { return angle * (u - 12 - kCheckedRig.cx) * (v - kCheckedRig.cy) / f; });
    EXPECT_TRUE(check.add(left, right).ok());
  }
  return check.report();
}

TEST(RigCheck, AnEyeTurnedToTheSideShowsInTheRowsOfTheCorners) {
  const RigReport sound = report_of_yaw(0, kCheckedRig);
  ASSERT_TRUE(sound.yaw_by_rows);
  EXPECT_NEAR(*sound.yaw_by_rows, 0, 0.1);
  EXPECT_FALSE(sound.yaw_by_motion) << "nothing was said of motion";
  EXPECT_TRUE(sound.findings.empty());
  EXPECT_TRUE(report_of_yaw(0.5, kCheckedRig).findings.empty()) << "other errors of a calibration look like it";
  for (const double degrees : {-1.0, 1.0}) {
    const RigReport report = report_of_yaw(degrees, kCheckedRig);
    EXPECT_NEAR(*report.yaw_by_rows, degrees, 0.15);
    EXPECT_LT(report.row_error, 1);
    ASSERT_EQ(reasons(report), only(Reason::NOT_STEREO));
    EXPECT_NE(report.findings[0].message().find(degrees > 0 ? "towards the left one" : "away from the left one"),
              std::string::npos)
        << report.findings[0].message();
  }
  EXPECT_FALSE(report_of_yaw(1, {}).yaw_by_rows) << "of no known camera";
}

TEST(RigCheck, NegativeDisparitiesAreFound) {
  // 12 pixels less than there should be: less than none in one part of the picture.
  const auto shift = [](Image& eye) {
    const Image as_it_was = copy_of(eye);
    for (int y = 0; y < kEyeHeight; ++y)
      for (int x = 0; x < kEyeWidth; ++x) eye.row(y)[x] = as_it_was.at(std::max(0, x - 12), y);
  };
  RigCheck check(kCheckedRig);
  for (unsigned seed = 1; seed <= 3; ++seed) {
    auto [left, right] = look(seed);
    shift(right);
    EXPECT_TRUE(check.add(left, right).ok());
  }
  const RigReport report = check.report();
  EXPECT_EQ(reasons(report), only(Reason::NOT_STEREO));
  EXPECT_GT(report.negative_disparity, 0.2);
  EXPECT_GT(report.positive_disparity, 0.1);
  EXPECT_NE(report.findings[0].message().find("negative"), std::string::npos) << report.findings[0].message();
}

TEST(RigCheck, EveryFindingHasAnAdvice) {
  for (const Reason reason :
       {Reason::ROWS_APART, Reason::NOT_STEREO, Reason::EYE_DEAD, Reason::OUT_OF_FOCUS, Reason::TOO_FEW_FEATURES})
    EXPECT_FALSE(rig_advice(reason).empty()) << reason_name(reason);
}

TEST(RigCheck, AnEyeThatRolledShowsInTheTrend) {
  const RigReport report = report_of_rows([](double u, double) { return 0.02 * (u - kEyeWidth / 2.0); });
  EXPECT_EQ(reasons(report), only(Reason::ROWS_APART));
  EXPECT_NEAR(report.row_offset, 0, 0.15);
  EXPECT_NEAR(report.row_slope_x, 0.02 * kEyeWidth, 0.3);
  EXPECT_NEAR(report.row_slope_y, 0, 0.3);
  const RigReport stretched = report_of_rows([](double, double v) { return 0.02 * (v - kEyeHeight / 2.0); });
  EXPECT_NEAR(stretched.row_slope_y, 0.02 * kEyeHeight, 0.3);
}

TEST(RigCheck, ExchangedEyes) {
  const RigReport report = report_of([](auto& pair) { std::swap(pair.first, pair.second); });
  EXPECT_EQ(reasons(report), only(Reason::NOT_STEREO));
  EXPECT_LT(report.positive_disparity, 0.01);
  EXPECT_LT(report.disparity, -10);
}

TEST(RigCheck, TheSamePictureTwice) {
  EXPECT_EQ(reasons(report_of([](auto& pair) { pair.second = copy_of(pair.first); })), only(Reason::NOT_STEREO));
  const RigReport shifted = report_of([](auto& pair) {  // by half a pixel: not byte by byte
    for (int y = 0; y < kEyeHeight; ++y)
      for (int x = 0; x + 1 < kEyeWidth; ++x)
        pair.second.row(y)[x] = static_cast<std::uint8_t>((pair.first.at(x, y) + pair.first.at(x + 1, y)) / 2);
  });
  EXPECT_EQ(reasons(shifted), only(Reason::NOT_STEREO));
}

TEST(RigCheck, EyesThatSeeDifferentThings) {
  const RigReport report = report_of([seed = 50U](auto& pair) mutable { pair.second = look(++seed).second; });
  EXPECT_EQ(reasons(report), only(Reason::TOO_FEW_FEATURES));
  EXPECT_EQ(report.row_error, 0);
}

TEST(RigCheck, ABlurredEyeIsNamed) {
  const RigReport right = report_of([](auto& pair) { blur(pair.second, 2.5); });
  ASSERT_FALSE(right.findings.empty());
  EXPECT_EQ(right.findings[0].reason(), Reason::OUT_OF_FOCUS);
  EXPECT_NE(right.findings[0].message().find("right eye"), std::string::npos);
  EXPECT_GT(*right.right.edge_width, 1.4 * *right.left.edge_width);
  const RigReport left = report_of([](auto& pair) { blur(pair.first, 2.5); });
  ASSERT_FALSE(left.findings.empty());
  EXPECT_NE(left.findings[0].message().find("left eye"), std::string::npos);
  EXPECT_EQ(report_of([](auto& pair) { blur(pair.first, 4), blur(pair.second, 4); }).findings.size(), 2u);
}

TEST(RigCheck, APairThatMovedIsNotOutOfFocus) {
  const RigReport report = report_of([pair_number = 0](auto& pair) mutable {
    if (pair_number++ > 0) return;
    blur(pair.first, 3);
    blur(pair.second, 3);
  });
  EXPECT_TRUE(report.findings.empty()) << report.findings[0].to_string();
}

TEST(RigCheck, ADarkEyeIsDead) {
  const RigReport report =
      report_of([](auto& pair) { pair.second = paint(kEyeWidth, kEyeHeight, [](int, int) { return 3; }); });
  EXPECT_EQ(reasons(report), only(Reason::EYE_DEAD));
  EXPECT_NE(report.findings[0].message().find("right eye"), std::string::npos);
  EXPECT_EQ(report.right.black, 1);
  EXPECT_EQ(report.right.mean, 3);
  EXPECT_LT(report.left.black, 0.1);
  const RigReport white =
      report_of([](auto& pair) { pair.first = paint(kEyeWidth, kEyeHeight, [](int, int) { return 255; }); });
  EXPECT_EQ(reasons(white), only(Reason::EYE_DEAD));
  EXPECT_EQ(white.left.saturated, 1);
}

TEST(RigCheck, AnEyeThatRepeatsItsPictureIsDead) {
  const Image stuck = look(1).first;
  const RigReport report = report_of([&](auto& pair) { pair.first = copy_of(stuck); });
  EXPECT_EQ(reasons(report), only(Reason::EYE_DEAD));
  EXPECT_NE(report.findings[0].message().find("left eye"), std::string::npos);
}

TEST(RigCheck, AWallWithoutTextureTellsNothing) {
  const RigReport report = report_of([](auto& pair) {
    for (Image* eye : {&pair.first, &pair.second})
      *eye = paint(kEyeWidth, kEyeHeight, [&](int x, int y) { return 60 + 0.2 * x + 0.1 * y + eye->at(x, y) % 3; });
  });
  EXPECT_EQ(reasons(report), only(Reason::TOO_FEW_FEATURES));
}

TEST(RigCheck, PicturesAreOfOneSize) {
  RigCheck check;
  EXPECT_EQ(check.add(Image(640, 480), Image(640, 479)).reason(), Reason::BAD_SIZE);
  EXPECT_EQ(check.add(Image(32, 32), Image(32, 32)).reason(), Reason::BAD_SIZE);
  EXPECT_TRUE(check.add(Image(640, 480), Image(640, 480)).ok());
  EXPECT_EQ(check.add(Image(320, 240), Image(320, 240)).reason(), Reason::BAD_SIZE);
  EXPECT_EQ(check.report().pairs, 1);
}

}  // namespace
}  // namespace relmap::vision
