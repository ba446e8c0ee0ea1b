#include "server/place/picture_query.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>

#include "frontend/vision/picture.h"
#include "frontend/vision/picture_appearance.h"

namespace relmap::place {
namespace {

Bytes png(const cv::Mat& picture) {
  Bytes file;
  cv::imencode(".png", picture, file);
  return file;
}

class PictureQuery : public testing::Test {
 protected:
  static constexpr int kWidth = 320, kHeight = 240, kShift = 12;
  static constexpr StereoCamera kCamera{300, 160, 120, 0.1, kWidth, kHeight};

  // A picture of blobs of all sizes, wide enough to cut a left and a right picture out of it.
  static cv::Mat texture() {
    std::mt19937 random(3);
    cv::Mat picture(kHeight, kWidth + kShift, CV_8U, cv::Scalar(128));
    for (int i = 0; i < 600; ++i) {
      const cv::Point at(static_cast<int>(random() % (kWidth + kShift)), static_cast<int>(random() % kHeight));
      cv::circle(picture, at, 2 + static_cast<int>(random() % 9), cv::Scalar(random() % 256), cv::FILLED, cv::LINE_AA);
    }
    cv::GaussianBlur(picture, picture, cv::Size(5, 5), 1);
    return picture;
  }

  // A wall at one depth: what is at u in the left picture is at u - kShift in the right one.
  const cv::Mat wall_ = texture();
  const Bytes left_ = png(wall_(cv::Rect(0, 0, kWidth, kHeight)));
  const Bytes right_ = png(wall_(cv::Rect(kShift, 0, kWidth, kHeight)));
};

TEST_F(PictureQuery, AStereoPairGivesFeaturesWithTheirDisparities) {
  const auto described = describe_picture({left_, right_, kCamera});
  ASSERT_TRUE(described.ok()) << described.status().to_string();
  ASSERT_GT(described->features.size(), 100u);
  EXPECT_EQ(described->camera, kCamera);
  std::size_t found = 0, wrong = 0;
  for (const AppearanceFeature& feature : described->features) {
    if (std::isnan(feature.disparity)) continue;
    ++found;
    wrong += std::abs(feature.disparity - kShift) > 0.5F;
  }
  EXPECT_GT(found, described->features.size() / 2);
  EXPECT_LT(wrong, found / 20);
}

TEST_F(PictureQuery, OnePictureIsMono) {
  const auto described = describe_picture({left_, {}, kCamera});
  ASSERT_TRUE(described.ok());
  EXPECT_FALSE(described->camera.is_stereo());
  EXPECT_TRUE(std::isnan(described->features.front().disparity));

  const auto unknown = describe_picture({left_, {}, {}});
  ASSERT_TRUE(unknown.ok());
  EXPECT_EQ(unknown->camera, (StereoCamera{0, 0.5 * (kWidth - 1), 0.5 * (kHeight - 1), 0, kWidth, kHeight}));
}

TEST_F(PictureQuery, DescribesAsTheMapDoes) {
  const auto described = describe_picture({left_, {}, {}});
  ASSERT_TRUE(described.ok());
  const auto picture = vision::decode_picture(left_);
  const auto expected = vision::picture_appearance(picture->grey);
  ASSERT_EQ(described->features.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(described->features[i].descriptor, expected[i].descriptor) << i;
}

TEST_F(PictureQuery, PicturesAndCameraMustFit) {
  StereoCamera other = kCamera;
  other.width = 640;
  other.cx = 320;
  EXPECT_EQ(describe_picture({left_, {}, other}).reason(), Reason::BAD_SIZE);
  const Bytes smaller = png(wall_(cv::Rect(0, 0, kWidth - 2, kHeight)));
  EXPECT_EQ(describe_picture({left_, smaller, kCamera}).reason(), Reason::BAD_SIZE);
  EXPECT_EQ(describe_picture({left_, right_, {}}).reason(), Reason::NOT_STEREO);
  StereoCamera mono = kCamera;
  mono.baseline = 0;
  EXPECT_EQ(describe_picture({left_, right_, mono}).reason(), Reason::NOT_STEREO);
  StereoCamera absurd = kCamera;
  absurd.f = 1e9;
  EXPECT_EQ(describe_picture({left_, {}, absurd}).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
}

// Pictures that cannot be a pair are refused before the map is searched.
TEST_F(PictureQuery, PicturesThatAreNotAPairAreRefused) {
  EXPECT_EQ(describe_picture({right_, left_, kCamera}).reason(), Reason::NOT_STEREO) << "exchanged";
}

TEST_F(PictureQuery, ARightPictureThatShowsNothingLeavesTheLeftOne) {
  const auto described = describe_picture({left_, png(cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(0))), kCamera});
  ASSERT_TRUE(described.ok()) << described.status().to_string();
  EXPECT_GT(described->features.size(), 100u);
  EXPECT_FALSE(described->camera.is_stereo());
}

TEST_F(PictureQuery, RawPicturesAreRectified) {
  StereoCalibration raw;
  raw.left = raw.right = RawCamera{300, 301, 161, 119, -0.05, 0.01, 0, 0, 0};
  raw.T_right_left.t = {-0.1, 0, 0};
  raw.width = kWidth;
  raw.height = kHeight;
  const auto described = describe_picture({left_, right_, raw});
  ASSERT_TRUE(described.ok()) << described.status().to_string();
  EXPECT_TRUE(described->camera.is_stereo());
  EXPECT_NEAR(described->camera.baseline, 0.1, 1e-6);
  EXPECT_GT(described->features.size(), 100u);
}

TEST_F(PictureQuery, ThePictureTellsWhichCameraOfItsSessionTookIt) {
  storage::Session session;
  session.number = 4;
  session.display_name = "tour";
  session.header.camera = kCamera;
  session.header.camera.width = kWidth - 20;
  const PictureCalibration rectified = session.header.camera;
  const Bytes smaller = png(wall_(cv::Rect(0, 0, kWidth - 20, kHeight)));
  const Bytes other = png(wall_(cv::Rect(0, 0, kWidth - 40, kHeight)));
  const auto camera = [&](std::optional<ByteSpan> left, bool said_rectified) {
    return camera_of_session(session, left, said_rectified);
  };
  EXPECT_TRUE(camera(other, false).or_throw() == rectified) << "it has no other";

  session.header.raw.emplace();
  session.header.raw->width = kWidth;
  session.header.raw->height = kHeight;
  EXPECT_TRUE(camera(left_, false).or_throw() == PictureCalibration(*session.header.raw));
  EXPECT_TRUE(camera(left_, true).or_throw() == rectified);
  EXPECT_TRUE(camera(smaller, false).or_throw() == rectified);
  EXPECT_TRUE(camera({}, false).or_throw() == rectified);
  EXPECT_EQ(camera(other, false).status().to_string(),
            "BAD_SIZE: the picture has 280 x 240 pixels; the camera of session 4 takes 320 x 240, rectified 300 x 240");

  session.header.camera = kNoCamera;
  EXPECT_EQ(camera(left_, false).status().to_string(), "NO_CALIBRATION: session 4 was imported without a camera");
  session.state = storage::SessionState::kDeleting;
  EXPECT_EQ(camera(left_, false).status().to_string(), "SESSION_DELETED: session tour was deleted");
}

TEST_F(PictureQuery, LargePicturesAreReducedAndTheirCameraWithThem) {
  cv::Mat large;
  cv::resize(wall_(cv::Rect(0, 0, kWidth, kHeight)), large, cv::Size(4 * kWidth, 4 * kHeight));
  const StereoCamera camera{1200, 640, 480, 0.1, 4 * kWidth, 4 * kHeight};
  const auto described = describe_picture({png(large), {}, camera});
  ASSERT_TRUE(described.ok());
  EXPECT_LE(described->camera.width * described->camera.height, 500'000);
  EXPECT_NEAR(described->camera.f / described->camera.width, camera.f / camera.width, 1e-3);
  EXPECT_NEAR(described->scale * 4 * kWidth, described->camera.width, 1e-6);
}

// The centres of the bright blobs of a picture.
std::vector<Vector2> blobs_of(const vision::Image& picture) {
  const cv::Mat pixels(picture.height(), picture.width(), CV_8UC1, const_cast<std::uint8_t*>(picture.row(0)));
  cv::Mat labels;
  const int count = cv::connectedComponents(pixels > 90, labels);
  std::vector<Vector2> sums(static_cast<std::size_t>(count), Vector2::Zero());
  std::vector<double> weights(static_cast<std::size_t>(count), 0);
  for (int y = 0; y < pixels.rows; ++y)
    for (int x = 0; x < pixels.cols; ++x) {
      const auto label = static_cast<std::size_t>(labels.at<int>(y, x));
      if (label == 0) continue;
      const double weight = pixels.at<std::uint8_t>(y, x) - 90.0;
      sums[label] += weight * Vector2(x, y);
      weights[label] += weight;
    }
  std::vector<Vector2> centres;
  for (std::size_t label = 1; label < sums.size(); ++label) centres.push_back(sums[label] / weights[label]);
  return centres;
}

// A picture that is too large to be described as it is, with and without a lens that distorts.
TEST_F(PictureQuery, TellsWhereThePictureThatWasSentShowsWhatItsFeaturesShow) {
  constexpr int kLargeWidth = 2400, kLargeHeight = 1800;
  cv::Mat picture(kLargeHeight, kLargeWidth, CV_8U, cv::Scalar(60));
  std::vector<Vector2> blobs;
  for (int row = 1; row < 6; ++row)
    for (int column = 1; column < 8; ++column) {
      const Vector2 at(300.0 * column + 3.3 * row, 300.0 * row - 2.7 * column);
      blobs.push_back(at);
      for (int y = static_cast<int>(at.y()) - 60; y <= at.y() + 60; ++y)
        for (int x = static_cast<int>(at.x()) - 60; x <= at.x() + 60; ++x)
          picture.at<std::uint8_t>(y, x) =
              static_cast<std::uint8_t>(60 + 180 * std::exp(-(Vector2(x, y) - at).squaredNorm() / (2.0 * 16 * 16)));
    }
  const Bytes file = png(picture);
  StereoCalibration lens;
  lens.left = {1800, 1800, 1200, 900, -0.2, 0.04, 0.0004, -0.0003, 0};
  lens.width = kLargeWidth;
  lens.height = kLargeHeight;
  const vision::Image reduced = std::move(vision::decode_picture(file)->grey);
  const auto rectifier = vision::Rectifier::make(vision::reduced(lens, reduced.width(), reduced.height()),
                                                 reduced.width(), reduced.height());
  ASSERT_TRUE(rectifier.ok());
  const vision::Image rectified = rectifier->left(reduced).or_throw();
  for (const bool distorted : {false, true}) {
    const auto described = describe_picture({file, {}, distorted ? PictureCalibration(lens) : PictureCalibration()});
    ASSERT_TRUE(described.ok()) << described.status().to_string();
    ASSERT_LT(described->scale, 1);
    const std::vector<Vector2> seen = blobs_of(distorted ? rectified : reduced);
    ASSERT_GE(seen.size(), 30u);
    for (const Vector2& pixel : seen) {
      double nearest = 1e9;
      for (const Vector2& blob : blobs) nearest = std::min(nearest, (described->sent.of(pixel) - blob).norm());
      EXPECT_LT(nearest, 0.5) << pixel.transpose();
    }
  }
}

}  // namespace
}  // namespace relmap::place
