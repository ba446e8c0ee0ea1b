#include "frontend/vision/encoded_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "frontend/vision/jpeg.h"
#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

Image waves(int width, int height) {
  const testing_textures::Waves texture(3, 20, 200);
  return testing_textures::paint(width, height, [&](int x, int y) { return texture.at(x, y); });
}

Image noise(int width, int height) {
  std::mt19937 random(1);
  return testing_textures::paint(width, height, [&](int, int) { return static_cast<double>(random() % 256); });
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) sum += std::abs(int{a.at(x, y)} - int{b.at(x, y)});
  return sum / (a.width() * a.height());
}

TEST(EncodedPicture, IsWholeAndNearlyTheSame) {
  const Image picture = waves(512, 384);
  const Bytes jpeg = encode_picture(picture);
  EXPECT_LE(jpeg.size(), kKeyframePictureBytes);
  const Image back = decode_jpeg(jpeg, 1).or_throw();
  ASSERT_EQ(back.width(), 512);
  ASSERT_EQ(back.height(), 384);
  EXPECT_LT(mean_difference(picture, back), 3);
}

TEST(EncodedPicture, PicturesThatAreTooLargeAreHalved) {
  const Image large = decode_jpeg(encode_picture(waves(1000, 760)), 1).or_throw();
  EXPECT_EQ(large.width(), 500);
  EXPECT_EQ(large.height(), 380);
  const Bytes jpeg = encode_picture(noise(640, 480));
  EXPECT_LE(jpeg.size(), kKeyframePictureBytes);
  EXPECT_LT(decode_jpeg(jpeg, 1).or_throw().width(), 640);
  EXPECT_TRUE(encode_picture(noise(640, 480), 200).empty()) << "nothing is that small";
}

TEST(EncodedPicture, ThumbnailsAreSmall) {
  const Bytes whole = encode_picture(waves(512, 384));
  ASSERT_GT(whole.size(), kMaxThumbnailBytes);
  const Bytes thumbnail = thumbnail_of(whole);
  EXPECT_LE(thumbnail.size(), kMaxThumbnailBytes);
  EXPECT_EQ(decode_jpeg(thumbnail, 1).or_throw().width(), 160);
  EXPECT_EQ(thumbnail_of(thumbnail), thumbnail);
  EXPECT_TRUE(thumbnail_of(Bytes(kMaxThumbnailBytes + 1, 0xff)).empty());
  EXPECT_TRUE(thumbnail_of({}).empty());
  const Bytes line = encode_picture(noise(12000, 1));
  ASSERT_GT(line.size(), kMaxThumbnailBytes);
  EXPECT_EQ(decode_jpeg(thumbnail_of(line), 1).or_throw().height(), 1);
}

}  // namespace
}  // namespace relmap::vision
