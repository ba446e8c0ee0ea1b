#include "frontend/vision/picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "frontend/vision/jpeg.h"
#include "frontend/vision/rectify.h"

namespace relmap::vision {
namespace {

cv::Mat scene(int width, int height, int type = CV_8UC1) {
  cv::Mat image(height, width, type);
  cv::RNG random(42);
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(image, image, {}, 3);
  return image;
}

Bytes encode(const cv::Mat& image, const char* extension, std::vector<int> parameters = {}) {
  Bytes bytes;
  cv::imencode(extension, image, bytes, parameters);
  return bytes;
}

// A PNG or JPEG header that declares a size, and nothing after it that could be decoded.
Bytes png_declaring(std::uint32_t width, std::uint32_t height) {
  Bytes bytes = encode(scene(8, 8), ".png");
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[16 + i] = static_cast<std::uint8_t>(width >> (24 - 8 * i));
    bytes[20 + i] = static_cast<std::uint8_t>(height >> (24 - 8 * i));
  }
  return bytes;
}
Bytes jpeg_declaring(int width, int height) {
  Bytes bytes = encode(scene(16, 16), ".jpg");
  for (std::size_t i = 2; i + 9 < bytes.size(); ++i)
    if (bytes[i] == 0xff && bytes[i + 1] == 0xc0) {
      bytes[i + 5] = static_cast<std::uint8_t>(height >> 8);
      bytes[i + 6] = static_cast<std::uint8_t>(height);
      bytes[i + 7] = static_cast<std::uint8_t>(width >> 8);
      bytes[i + 8] = static_cast<std::uint8_t>(width);
      break;
    }
  return bytes;
}

TEST(Picture, ReadsSizesFromTheHeader) {
  for (const auto& [width, height] : {std::pair{640, 480}, std::pair{17, 1023}}) {
    const auto jpeg = picture_size(encode(scene(width, height), ".jpg"));
    ASSERT_TRUE(jpeg.ok());
    EXPECT_EQ(std::pair(jpeg->width, jpeg->height), std::pair(width, height));
    EXPECT_FALSE(jpeg->png);
    const auto png = picture_size(encode(scene(width, height), ".png"));
    ASSERT_TRUE(png.ok());
    EXPECT_EQ(std::pair(png->width, png->height), std::pair(width, height));
    EXPECT_TRUE(png->png);
  }
}

TEST(Picture, DecodesGreyColourAndSixteenBits) {
  const cv::Mat grey = scene(320, 200);
  cv::Mat colour, deep;
  cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
  grey.convertTo(deep, CV_16UC1, 257);
  for (const Bytes& file :
       {encode(grey, ".png"), encode(colour, ".png"), encode(deep, ".png"),
        encode(grey, ".jpg", {cv::IMWRITE_JPEG_QUALITY, 100}), encode(colour, ".jpg", {cv::IMWRITE_JPEG_QUALITY, 100}),
        encode(colour, ".jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_QUALITY, 100})}) {
    const auto picture = decode_picture(file, 0);
    ASSERT_TRUE(picture.ok()) << picture.status().to_string();
    ASSERT_EQ(picture->grey.width(), 320);
    ASSERT_EQ(picture->grey.height(), 200);
    EXPECT_EQ(picture->scale, 1);
    for (int y = 0; y < 200; y += 7)
      for (int x = 0; x < 320; x += 7) EXPECT_NEAR(picture->grey.at(x, y), grey.at<std::uint8_t>(y, x), 4);
  }
}

TEST(Picture, ReducesToTheLimitAndSaysByHowMuch) {
  for (const char* extension : {".jpg", ".png"})
    for (const auto& [width, height] : {std::pair{2000, 1500}, std::pair{1242, 375}, std::pair{800, 700}}) {
      const auto picture = decode_picture(encode(scene(width, height), extension), 0.3e6);
      ASSERT_TRUE(picture.ok());
      const double pixels = static_cast<double>(picture->grey.width()) * picture->grey.height();
      EXPECT_LE(pixels, 0.3e6);
      EXPECT_GT(pixels, 0.29e6);
      EXPECT_NEAR(picture->scale * width, picture->grey.width(), 1e-9);
      EXPECT_NEAR(picture->scale * height, picture->grey.height(), 2);
    }
}

TEST(Picture, RefusesWhatIsNoPicture) {
  EXPECT_EQ(picture_size({}).reason(), Reason::NOT_A_PICTURE);
  EXPECT_EQ(decode_picture(as_bytes("GIF89a, or so it says")).reason(), Reason::NOT_A_PICTURE);
  EXPECT_EQ(decode_picture(Bytes(1000, 0)).reason(), Reason::NOT_A_PICTURE);
}

TEST(Picture, RefusesGigapixelsByTheHeaderAlone) {
  EXPECT_EQ(decode_picture(png_declaring(40000, 30000)).reason(), Reason::PICTURE_TOO_LARGE);
  EXPECT_EQ(decode_picture(png_declaring(0xffffffff, 0xffffffff)).reason(), Reason::PICTURE_TOO_LARGE);
  EXPECT_EQ(decode_picture(jpeg_declaring(65500, 65500)).reason(), Reason::PICTURE_TOO_LARGE);
  EXPECT_EQ(picture_size(Bytes(kMaxPictureBytes + 1, 0xff)).reason(), Reason::PICTURE_TOO_LARGE);
  EXPECT_EQ(picture_size(png_declaring(0, 10)).reason(), Reason::PICTURE_DAMAGED);
  EXPECT_EQ(picture_size(jpeg_declaring(0, 10)).reason(), Reason::PICTURE_DAMAGED);
}

// libjpeg would hold its 42 megapixels of coefficients all at once.
TEST(Picture, RefusesProgressiveJpegsThatNeedTooMuchMemory) {
  Bytes baseline = jpeg_declaring(6500, 6500);
  for (std::size_t i = 2; i + 1 < baseline.size(); ++i)
    if (baseline[i] == 0xff && baseline[i + 1] == 0xc0) {
      baseline[i + 1] = 0xc2;
      break;
    }
  // One component: 85 MB pass, 98 do not.
  EXPECT_NE(decode_picture(baseline).reason(), Reason::PICTURE_TOO_LARGE);
  Bytes larger = jpeg_declaring(7000, 7000);
  for (std::size_t i = 2; i + 1 < larger.size(); ++i)
    if (larger[i] == 0xff && larger[i + 1] == 0xc0) {
      larger[i + 1] = 0xc2;
      break;
    }
  EXPECT_EQ(decode_picture(larger).reason(), Reason::PICTURE_TOO_LARGE);
}

TEST(Picture, RefusesTruncatedFiles) {
  for (const char* extension : {".jpg", ".png"}) {
    const Bytes whole = encode(scene(40, 30), extension);
    for (std::size_t size = 8; size < whole.size(); size += 1 + size / 16) {
      const auto cut = decode_picture(ByteSpan(whole).first(size));
      EXPECT_FALSE(cut.ok()) << extension << " cut to " << size << " of " << whole.size();
      EXPECT_EQ(cut.reason(), Reason::PICTURE_DAMAGED);
    }
  }
}

// OpenCV would return the rest of the picture grey, without an error.
TEST(Picture, RefusesAJpegThatLacksAPartOfItsPixels) {
  Bytes file = encode(scene(320, 200), ".jpg");
  file.erase(file.end() - 302, file.end() - 2);
  const auto picture = decode_picture(file, 0);
  EXPECT_EQ(picture.reason(), Reason::PICTURE_DAMAGED);
  EXPECT_NE(picture.status().message().find("premature end"), std::string::npos) << picture.status().to_string();
}

TEST(Picture, AcceptsAJpegThatIsPaddedBeforeItsEnd) {
  const Bytes file = encode(scene(320, 200), ".jpg");
  Bytes padded = file;
  padded.insert(padded.end() - 2, 5, 0);
  const auto plain = decode_picture(file, 0), with_padding = decode_picture(padded, 0);
  ASSERT_TRUE(plain.ok() && with_padding.ok()) << with_padding.status().to_string();
  EXPECT_TRUE(std::equal(plain->grey.row(0), plain->grey.row(200), with_padding->grey.row(0)));
}

TEST(Picture, DetectsEveryFlippedByteOfAPng) {
  Bytes file = encode(scene(24, 16), ".png");
  for (std::size_t i = 8; i < file.size(); ++i) {
    file[i] ^= 0x5a;
    EXPECT_FALSE(decode_picture(file).ok()) << i;
    file[i] ^= 0x5a;
  }
  EXPECT_TRUE(decode_picture(file).ok());
}

TEST(Picture, DecodesJpegsToTheSamePixelsAsOpenCv) {
  cv::Mat colour = scene(321, 203, CV_8UC3);
  for (const Bytes& file : {encode(colour, ".jpg"), encode(scene(321, 203), ".jpg"),
                            encode(colour, ".jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1})})
    for (const auto& [reduction, flags] : {std::pair{1, cv::IMREAD_GRAYSCALE},
                                           {2, cv::IMREAD_REDUCED_GRAYSCALE_2},
                                           {4, cv::IMREAD_REDUCED_GRAYSCALE_4}}) {
      const cv::Mat expected = cv::imdecode(file, flags);
      const auto grey = decode_jpeg(file, reduction);
      ASSERT_TRUE(grey.ok()) << grey.status().to_string();
      ASSERT_EQ(cv::Size(grey->width(), grey->height()), expected.size());
      EXPECT_TRUE(std::equal(expected.begin<std::uint8_t>(), expected.end<std::uint8_t>(), grey->row(0)));
    }
}

// The caller reports what is wrong with which file; what libraries write to standard error does not name the file.
TEST(Picture, FlippedBytesWriteNothingToStandardError) {
  ::testing::internal::CaptureStderr();
  for (const char* extension : {".jpg", ".png"}) {
    Bytes file = encode(scene(24, 16), extension);
    for (std::size_t i = 0; i < file.size(); i += 3) {
      file[i] ^= 0x5a;
      const auto picture = decode_picture(file, 1e5);
      if (picture.ok()) {
        EXPECT_LE(static_cast<double>(picture->grey.width()) * picture->grey.height(), 1e5);
      }
      file[i] ^= 0x5a;
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Reduced, OfARectifiedCalibrationIsRectified) {
  StereoCalibration calibration;
  calibration.left = {960, 960, 399.5, 265, 0, 0, 0, 0, 0};
  calibration.width = 800;
  calibration.height = 531;
  calibration.rectified = true;
  const StereoCalibration smaller = reduced(calibration, 613, 407);
  EXPECT_EQ(smaller.left.fx, smaller.left.fy);
  EXPECT_TRUE(Rectifier::make(smaller, 613, 407).ok());
}

TEST(Reduced, SeesTheSamePointsAtTheSamePlaces) {
  const StereoCamera camera{300, 160, 120, 0.1, 320, 240};
  const StereoCamera half = reduced(camera, 160, 120);
  const Vector3 point(0.3, -0.2, 2);
  const StereoPixel full = camera.project(point), small = half.project(point);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR((full[i] + 0.5) / 2 - 0.5, small[i], 1e-9);
}

}  // namespace
}  // namespace relmap::vision
