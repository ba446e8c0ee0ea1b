#include "frontend/capture/stereo_layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace relmap::capture {
namespace {

using Raw = std::vector<std::uint8_t>;

constexpr ColourFilter kFilters[] = {ColourFilter::kNone, ColourFilter::kRGGB, ColourFilter::kGBRG, ColourFilter::kGRBG,
                                     ColourFilter::kBGGR};

Raw noise(const StereoLayout& layout, unsigned seed) {
  std::mt19937 random(seed);
  Raw raw(layout.bytes());
  for (std::uint8_t& byte : raw) byte = static_cast<std::uint8_t>(random());
  return raw;
}

// The byte of an eye at a pixel, mirrored at the border.
int pixel(const StereoLayout& layout, const Raw& raw, bool left, int x, int y) {
  const auto mirrored = [](int i, int size) { return i < 0 ? -i : i >= size ? 2 * (size - 1) - i : i; };
  x = mirrored(x, layout.width), y = mirrored(y, layout.height);
  const bool first = left == (layout.first_byte == FirstByte::kLeft);
  return raw[2 * static_cast<std::size_t>(y * layout.width + x) + (first ? 0 : 1)];
}

int reference(const StereoLayout& layout, const Raw& raw, bool left, int x, int y) {
  if (layout.filter == ColourFilter::kNone) return pixel(layout, raw, left, x, y);
  double sum = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      sum += (2 - std::abs(dx)) * (2 - std::abs(dy)) * pixel(layout, raw, left, x + dx, y + dy);
  return static_cast<int>(std::floor(sum / 16 + 0.5));
}

void expect_reference(const StereoLayout& layout, const Raw& raw, const vision::Image& picture, bool left) {
  ASSERT_EQ(picture.width(), layout.width);
  ASSERT_EQ(picture.height(), layout.height);
  for (int y = 0; y < layout.height; ++y)
    for (int x = 0; x < layout.width; ++x)
      ASSERT_EQ(picture.at(x, y), reference(layout, raw, left, x, y))
          << (left ? "left" : "right") << " eye of " << layout.width << " x " << layout.height << ", filter "
          << static_cast<int>(layout.filter) << ", pixel " << x << ", " << y;
}

// Colours of a filter's two by two pixels.
const char* letters(ColourFilter filter) {
  switch (filter) {
    case ColourFilter::kRGGB:
      return "RGGB";
    case ColourFilter::kGBRG:
      return "GBRG";
    case ColourFilter::kGRBG:
      return "GRBG";
    case ColourFilter::kBGGR:
      return "BGGR";
    case ColourFilter::kNone:
      break;
  }
  return "YYYY";
}

TEST(StereoLayout, UnpacksEveryPatternAndSizeLikeTheReference) {
  const std::pair<int, int> sizes[] = {{1, 1},  {1, 5},   {5, 1},  {2, 2},  {3, 2},  {7, 5},  {8, 3},  {15, 4},
                                       {16, 2}, {17, 17}, {31, 3}, {33, 7}, {47, 3}, {64, 2}, {65, 9}, {161, 3}};
  unsigned seed = 0;
  for (const auto& [width, height] : sizes)
    for (const ColourFilter filter : kFilters)
      for (const FirstByte first : {FirstByte::kLeft, FirstByte::kRight}) {
        const StereoLayout layout{width, height, first, filter};
        const Raw raw = noise(layout, ++seed);
        vision::Image left, right, plain_left, plain_right;
        const Status status = unpack(layout, raw, left, right);
        EXPECT_EQ(detail::unpack_plainly(layout, raw, plain_left, plain_right).reason(), status.reason());
        if (filter != ColourFilter::kNone && std::min(width, height) < 2) {
          EXPECT_EQ(status.reason(), Reason::BAD_SIZE);
          continue;
        }
        ASSERT_TRUE(status.ok()) << status.to_string();
        expect_reference(layout, raw, left, true);
        expect_reference(layout, raw, right, false);
        EXPECT_TRUE(vision::same_picture(left, plain_left));
        EXPECT_TRUE(vision::same_picture(right, plain_right));
      }
}

TEST(StereoLayout, FlatColoursBecomeFlatGreyToTheBorder) {
  constexpr int kRed = 200, kGreen = 80, kBlue = 40, kGrey = (kRed + 2 * kGreen + kBlue) / 4;
  for (const ColourFilter filter : {ColourFilter::kRGGB, ColourFilter::kGBRG, ColourFilter::kGRBG, ColourFilter::kBGGR})
    for (const auto& [width, height] : {std::pair{40, 30}, {41, 31}, {2, 2}, {3, 3}}) {
      const StereoLayout layout{width, height, FirstByte::kRight, filter};
      Raw raw;
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const char letter = letters(filter)[2 * (y % 2) + x % 2];
          const int value = letter == 'R' ? kRed : letter == 'G' ? kGreen : kBlue;
          raw.push_back(static_cast<std::uint8_t>(value));
          raw.push_back(static_cast<std::uint8_t>(value));
        }
      vision::Image left, right;
      ASSERT_TRUE(unpack(layout, raw, left, right).ok());
      for (const vision::Image* picture : {&left, &right})
        for (int y = 0; y < height; ++y)
          for (int x = 0; x < width; ++x)
            ASSERT_EQ(picture->at(x, y), kGrey) << letters(filter) << ' ' << x << ", " << y;
    }
}

TEST(StereoLayout, MovesNothing) {
  constexpr int kSize = 49;
  for (const double shift : {0.0, 0.25, 0.5, 0.8}) {
    const double centre_x = 24 + shift, centre_y = 23 - shift;
    StereoLayout layout{kSize, kSize, FirstByte::kLeft, ColourFilter::kGRBG};
    Raw raw;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const double r2 = std::pow(x - centre_x, 2) + std::pow(y - centre_y, 2);
        raw.insert(raw.end(), 2, static_cast<std::uint8_t>(std::lround(250 * std::exp(-r2 / 32))));
      }
    vision::Image left, right;
    ASSERT_TRUE(unpack(layout, raw, left, right).ok());
    for (const vision::Image* picture : {&left, &right}) {
      double sum = 0, sum_x = 0, sum_y = 0;
      for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
          sum += picture->at(x, y);
          sum_x += x * picture->at(x, y);
          sum_y += y * picture->at(x, y);
        }
      EXPECT_NEAR(sum_x / sum, centre_x, 0.01);
      EXPECT_NEAR(sum_y / sum, centre_y, 0.01);
    }
  }
}

TEST(StereoLayout, PassesOverPaddingAndUsesMemoryAgain) {
  const StereoLayout layout{33, 5, FirstByte::kRight, ColourFilter::kNone};
  Raw raw = noise(layout, 7);
  const Raw exact = raw;
  raw.resize(raw.size() + 1000, 0xee);
  vision::Image left(33, 5), right(5, 33);
  const std::uint8_t* const memory = left.row(0);
  ASSERT_TRUE(unpack(layout, raw, left, right).ok());
  EXPECT_EQ(left.row(0), memory);
  expect_reference(layout, exact, left, true);
  expect_reference(layout, exact, right, false);
}

TEST(StereoLayout, RefusesWhatIsTooShortOrNoSize) {
  StereoLayout layout{16, 4, FirstByte::kRight, ColourFilter::kNone};
  Raw raw(layout.bytes() - 1);
  vision::Image left(3, 3), right;
  const Status status = unpack(layout, raw, left, right);
  EXPECT_EQ(status.to_string(), "BAD_SIZE: a frame of 127 bytes; two eyes of 16 x 4 have 128");
  EXPECT_EQ(left.width(), 3);
  for (const auto& [width, height] : {std::pair{0, 4}, {4, 0}, {-2, -2}, {-4, 4}, {2147483647, 2147483647}}) {
    layout.width = width, layout.height = height;
    EXPECT_EQ(unpack(layout, raw, left, right).reason(), Reason::BAD_SIZE) << width << " x " << height;
  }
}

}  // namespace
}  // namespace relmap::capture
