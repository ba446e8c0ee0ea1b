#include "client/pair_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>
#include <vector>

#include "client/testing/svg.h"

namespace relmap::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string jpeg(int width, int height) {
  cv::Mat picture(height, width, CV_8U);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) picture.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(x ^ y);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", picture, bytes);
  return {bytes.begin(), bytes.end()};
}

PairPicture::Side side(const std::string& title, int width, int height, double scale = 1) {
  PairPicture::Side side;
  side.title = title;
  side.details = {"2026-11-30T08:15:12.120Z, session 1, morning, of robot cart"};
  side.picture = {
      jpeg(width, height), static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), scale, {}};
  side.camera_width = static_cast<std::uint32_t>(width / scale);
  side.camera_height = static_cast<std::uint32_t>(height / scale);
  return side;
}

PairPicture pair_of(int width, int height) {
  PairPicture pair;
  pair.title = "2:85/1: accepted";
  pair.left = side("1:5", width, height);
  pair.right = side("2:85", width, height);
  for (int k = 0; k < 20; ++k) {
    const Vector2 at(20 + (width - 60) * k / 20.0, 15 + (height - 40) * ((k * 7) % 20) / 20.0);
    pair.points.push_back({at, at + Vector2(12, 8), k % 4 != 0, k % 5 == 0});
  }
  pair.gauges = {{0.7, "suspicion 0.70 of 1", {228, 12, 107}, true}, {0.4, "0.40 contradicted", {228, 12, 107}, false}};
  pair.notes = {"Motion: contradicts it", "3 closures agree with it"};
  return pair;
}

// Whether a line of the SVG joins the two points.
bool is_joined(const std::vector<std::vector<Vector2>>& lines, const Vector2& a, const Vector2& b) {
  return std::any_of(lines.begin(), lines.end(), [&](const std::vector<Vector2>& line) {
    return line.size() == 2 && (line[0] - a).norm() < 0.02 && (line[1] - b).norm() < 0.02;
  });
}

void expect_lines_join_what_matches(const PairPicture& pair) {
  const std::string svg = draw_pair(pair, PictureFormat::kSvg).or_throw();
  const std::vector<Box> pictures = pictures_of(svg);
  ASSERT_EQ(pictures.size(), 2u);
  const auto lines = lines_of(svg);
  for (const PairPicture::Point& point : pair.points) {
    const auto at = [](const Box& box, const PairPicture::Side& side, const Vector2& pixel) {
      return Vector2(box.low + pixel * box.size().x() / side.camera_width);
    };
    EXPECT_TRUE(is_joined(lines, at(pictures[0], pair.left, point.left), at(pictures[1], pair.right, point.right)))
        << point.left.transpose();
  }
}

void expect_texts_are_clear(const std::string& svg) {
  expect_nothing_cut_off(svg);
  const std::vector<SvgText> texts = texts_of(svg);
  for (const SvgText& text : texts) {
    for (const Box& picture : pictures_of(svg)) EXPECT_FALSE(text.box().overlaps(picture)) << text.text;
    for (const SvgText& other : texts)
      if (&text != &other) {
        EXPECT_FALSE(text.box().overlaps(other.box())) << text.text << " | " << other.text;
      }
    for (const std::vector<Vector2>& line : lines_of(svg))
      for (double t = 0; line.size() == 2 && t <= 1; t += 0.01)
        ASSERT_FALSE(text.box().contains(line[0] + t * (line[1] - line[0]))) << text.text;
  }
}

TEST(PairPicture, LinesJoinThePixelsThatMatch) {
  expect_lines_join_what_matches(pair_of(640, 480));
  expect_lines_join_what_matches(pair_of(1242, 375));
  PairPicture reduced = pair_of(640, 480);
  reduced.right = side("2:85", 320, 240, 0.5);
  expect_lines_join_what_matches(reduced);
}

TEST(PairPicture, NothingLiesOverItsTexts) {
  for (const int height : {480, 375, 240})
    expect_texts_are_clear(draw_pair(pair_of(960, height), PictureFormat::kSvg).or_throw());
}

TEST(PairPicture, WidePicturesLieAboveEachOther) {
  const auto boxes = pictures_of(draw_pair(pair_of(1242, 375), PictureFormat::kSvg).or_throw());
  EXPECT_GT(boxes[1].low.y(), boxes[0].high.y());
  EXPECT_EQ(boxes[1].low.x(), boxes[0].low.x());
  const auto beside = pictures_of(draw_pair(pair_of(640, 480), PictureFormat::kSvg).or_throw());
  EXPECT_GT(beside[1].low.x(), beside[0].high.x());
}

TEST(PairPicture, SaysWhyThereIsNoPictureAndDrawsThePointsAllTheSame) {
  PairPicture pair = pair_of(640, 480);
  const int points = count_in(draw_pair(pair, PictureFormat::kSvg).or_throw(), "<circle");
  pair.left.picture = {};
  pair.left.picture.missing = {Reason::UNSUPPORTED, "dropped after 30 days, to make room"};
  const std::string svg = draw_pair(pair, PictureFormat::kSvg).or_throw();
  EXPECT_THAT(said_in(svg), HasSubstr("no picture: dropped after 30 days, to make room"));
  EXPECT_EQ(pictures_of(svg).size(), 1u);
  EXPECT_EQ(count_in(svg, "<circle"), points);

  pair.left.picture = {"\xff\xd8\xff damaged", 640, 480, 1, {}};
  EXPECT_THAT(said_in(draw_pair(pair, PictureFormat::kSvg).or_throw()),
              HasSubstr("no picture: the picture cannot be read"));
  EXPECT_TRUE(draw_pair(pair, PictureFormat::kPng).ok());
}

TEST(PairPicture, LinesAreFewEnoughToSeeThePictures) {
  PairPicture pair = pair_of(640, 480);
  for (int k = 0; k < 900; ++k) pair.points.push_back({{k % 600, k / 2}, {k % 600, k / 2}, k % 2 == 0, false});
  const std::string svg = draw_pair(pair, PictureFormat::kSvg).or_throw();
  std::set<std::string> joined;
  for (const auto& line : lines_of(svg))
    if (line.size() == 2) joined.insert(std::to_string(line[0].x()) + "," + std::to_string(line[0].y()));
  EXPECT_LE(joined.size(), kMaxInlierLines + kMaxOutlierLines);
  EXPECT_THAT(said_in(svg), HasSubstr("465 of 920 matches agree, 60 of them are joined by lines; dashed: others"));
}

TEST(PairPicture, AnotherPlaceThatFitsStandsBelow) {
  PairPicture pair = pair_of(640, 480);
  const double height = page_of(draw_pair(pair, PictureFormat::kSvg).or_throw()).second;
  pair.other = side("Another place that fits: 3:44", 640, 480);
  const std::string svg = draw_pair(pair, PictureFormat::kSvg).or_throw();
  const std::vector<Box> pictures = pictures_of(svg);
  ASSERT_EQ(pictures.size(), 3u);
  EXPECT_GT(pictures[2].low.y(), pictures[1].high.y());
  EXPECT_LT(pictures[2].high.y(), page_of(svg).second);
  EXPECT_GT(page_of(svg).second, height);
  expect_texts_are_clear(svg);
}

TEST(PairPicture, ASheetHasARowForEachPair) {
  PairSheet sheet{"Loop closures", "3 loop closures", {pair_of(640, 480), pair_of(640, 480), pair_of(1242, 375)}};
  sheet.pairs[1].notes.push_back(std::string(900, 'm') + " and many more words that have to find room beside them");
  const std::string svg = draw_pair_sheet(sheet, PictureFormat::kSvg).or_throw();
  const std::vector<Box> pictures = pictures_of(svg);
  ASSERT_EQ(pictures.size(), 6u);
  EXPECT_GT(pictures[2].low.y(), pictures[0].high.y());
  EXPECT_GT(pictures[4].low.y(), pictures[3].high.y());
  expect_texts_are_clear(svg);
  EXPECT_EQ(draw_pair_sheet({}, PictureFormat::kSvg).reason(), Reason::EMPTY_MAP);
}

TEST(PairPicture, HostileNamesAreTextOnly) {
  PairPicture pair = pair_of(640, 480);
  pair.left.details = {"session <script>alert(1)</script> \u202Eevil"};
  const std::string svg = draw_pair(pair, PictureFormat::kSvg).or_throw();
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
  EXPECT_THAT(svg, Not(HasSubstr("\u202E")));
}

TEST(PairPicture, APngShowsTheMatchedColours) {
  const std::string png = draw_pair(pair_of(640, 480), PictureFormat::kPng).or_throw();
  const cv::Mat page = cv::imdecode(std::vector<std::uint8_t>(png.begin(), png.end()), cv::IMREAD_COLOR);
  ASSERT_FALSE(page.empty());
  EXPECT_GT(page.cols, 1280);
  int coloured = 0;
  for (int y = 0; y < page.rows; ++y)
    for (int x = 0; x < page.cols; ++x) {
      const auto& pixel = page.at<cv::Vec3b>(y, x);
      coloured += *std::max_element(pixel.val, pixel.val + 3) - *std::min_element(pixel.val, pixel.val + 3) > 60;
    }
  EXPECT_GT(coloured, 2000) << "lines in colour on grey pictures";
}

}  // namespace
}  // namespace relmap::client
