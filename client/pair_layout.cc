#include "client/pair_layout.h"

#include <algorithm>
#include <cmath>

#include "client/colour_scale.h"
#include "client/map_colours.h"
#include "client/text_wrap.h"
#include "proto/base/number_text.h"

namespace relmap::client {
namespace {

constexpr double kPictureGap = 14;  // between the pictures
constexpr double kWideRatio = 2.2;  // wider pictures than this, as a ratio, lie above each other
constexpr double kMaxRatio = 1.1;   // of a picture, in widths of its half of the column
constexpr double kSideTitleLine = 20, kSideDetailLine = 15, kCountLine = 18;
constexpr Colour kNoPictureColour{226, 227, 224}, kDarkColour{22, 24, 28}, kOutlierColour{206, 208, 212};

const TextStyle kSideTitle{.size = 15, .colour = kInkColour, .bold = true},
    kSideDetail{.size = 12, .colour = kFaintColour}, kCountStyle{.size = 13, .colour = kInkColour},
    kMissingStyle{.size = 14, .colour = kInkColour};

// Evenly chosen elements, at most `most`, in their order.
template <typename Element>
std::vector<Element> thinned_out(const std::vector<Element>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<Element> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(all[i * all.size() / most]);
  return some;
}

void draw_ring(Drawing& out, const Vector2& at, double radius, const Stroke& stroke) {
  std::vector<Vector2> circle;
  for (int k = 0; k <= 12; ++k) circle.push_back(at + radius * Vector2(std::cos(M_PI * k / 6), std::sin(M_PI * k / 6)));
  out.polyline(circle, stroke);
}

void draw_match_end(Drawing& out, const Vector2& at, bool hollow, Colour colour) {
  if (hollow) {
    draw_ring(out, at, 2.4, {kDarkColour, 2.6, 1, 0});
    draw_ring(out, at, 2.4, {colour, 1.3, 1, 0});
  } else {
    out.disc(at, 2.4, colour, 0.8, kDarkColour);
  }
}

// Draws the picture, or a grey ground; then returns why.
std::string draw_picture(Drawing& out, const FramePicture& picture, const Box& box) {
  Status missing = picture.missing;
  if (missing.ok() && !picture.data.empty()) missing = out.picture(box.low, box.size(), picture.data);
  if (missing.ok() && !picture.data.empty()) return {};
  out.rectangle(box.low, box.size(), kNoPictureColour, 1);
  out.polyline({box.low, {box.high.x(), box.low.y()}, box.high, {box.low.x(), box.high.y()}, box.low},
               {kFaintColour, 1, 1, 5});
  return "no picture: " + (missing.ok() ? std::string("the map keeps none of it") : missing.message());
}

// Above the points, which could make the text hard to read.
void draw_missing(Drawing& out, const std::string& text, const Box& box) {
  const std::vector<std::string> lines = wrap(out, text, kMissingStyle, box.size().x() - 28);
  const double line = 18, tall = std::min(box.size().y() - 8, 12 + line * static_cast<double>(lines.size()));
  out.rectangle(box.low + Vector2(6, 6), {box.size().x() - 12, tall}, kNoPictureColour, 1);
  double y = box.low.y() + 22;
  for (const std::string& words : lines) {
    if (y > box.high.y() - 4) break;
    out.text({box.low.x() + 14, y}, words, kMissingStyle);
    y += line;
  }
}

}  // namespace

Vector2 camera_size(const PairPicture::Side& side) {
  const FramePicture& picture = side.picture;
  if (picture.width > 0 && picture.height > 0) return Vector2(picture.width, picture.height) / picture.scale;
  if (side.camera_width > 0 && side.camera_height > 0)
    return {static_cast<double>(side.camera_width), static_cast<double>(side.camera_height)};
  return {4, 3};
}

void draw_side(Drawing& out, const PairPicture::Side& side, const Box& box) {
  if (const std::string missing = draw_picture(out, side.picture, box); !missing.empty())
    draw_missing(out, missing, box);
}

PairLayout::PairLayout(const PairPicture& pair, const Drawing& measure, double width) : pair_(pair), measure_(measure) {
  const Vector2 left = camera_size(pair.left), right = camera_size(pair.right);
  stacked_ = left.x() > kWideRatio * left.y() && right.x() > kWideRatio * right.y();
  const double half = stacked_ ? width : (width - kPictureGap) / 2;
  // Both pictures are scaled to the width of their half, or, if they are tall, to the greatest height.
  const auto fitted = [&](const Vector2& camera) { return std::min(half / camera.x(), kMaxRatio * half / camera.y()); };
  left_scale_ = fitted(left);
  right_scale_ = fitted(right);
  const auto head = [&](const PairPicture::Side& side) {
    double below = kSideTitleLine;
    for (const std::string& detail : side.details)
      below += kSideDetailLine * static_cast<double>(wrap(measure, detail, kSideDetail, half).size());
    return below;
  };
  double below_pictures = 0;
  if (stacked_) {
    left_.low = {0, head(pair.left)};
    left_.high = left_.low + left_scale_ * left;
    right_.low = {0, left_.high.y() + kPictureGap};
    add_words(pair.left, {0, 0}, half);
    // Below its picture: lines cross what is between the two.
    below_pictures = head(pair.right);
    add_words(pair.right, {0, right_.low.y() + right_scale_ * right.y() + 2}, half);
  } else {
    const double top = std::max(head(pair.left), head(pair.right));
    left_.low = {0, top};
    left_.high = left_.low + left_scale_ * left;
    right_.low = {half + kPictureGap, top};
    add_words(pair.left, {0, 0}, half);
    add_words(pair.right, {half + kPictureGap, 0}, half);
  }
  right_.high = right_.low + right_scale_ * right;

  std::size_t inliers = 0;
  for (const PairPicture::Point& point : pair.points) inliers += point.inlier ? 1 : 0;
  std::string count = pair.no_points;
  if (!pair.points.empty())
    count = count_text(inliers) + " of " + counted_text(pair.points.size(), "match") + " agree" +
            (inliers > kMaxInlierLines ? ", " + std::to_string(kMaxInlierLines) + " of them are joined by lines" : "") +
            (inliers < pair.points.size() ? "; dashed: others" : "");
  // The plural of "match" has an e.
  if (const std::size_t at = count.find(" matchs "); at != std::string::npos) count.replace(at, 8, " matches ");
  double y = std::max(left_.high.y(), right_.high.y()) + below_pictures + (stacked_ ? 4 : 0);
  if (!count.empty())
    for (const std::string& line : wrap(measure, count, kCountStyle, width)) {
      words_.push_back({{0, y + 0.85 * kCountLine}, line, kCountStyle});
      y += kCountLine;
    }
  height_ = y + 4;
}

void PairLayout::add_words(const PairPicture::Side& side, const Vector2& at, double width) {
  double y = at.y() + 0.75 * kSideTitleLine;
  words_.push_back({{at.x(), y}, wrap(measure_, side.title, kSideTitle, width).front(), kSideTitle});
  for (const std::string& detail : side.details)
    for (const std::string& line : wrap(measure_, detail, kSideDetail, width)) {
      y += kSideDetailLine;
      words_.push_back({{at.x(), y}, line, kSideDetail});
    }
}

void PairLayout::draw(Drawing& out, const Vector2& corner) const {
  struct Half {
    const PairPicture::Side& side;
    Box box;
    std::string missing;
  };
  Half halves[] = {{pair_.left, {left_.low + corner, left_.high + corner}, {}},
                   {pair_.right, {right_.low + corner, right_.high + corner}, {}}};
  for (Half& half : halves) half.missing = draw_picture(out, half.side.picture, half.box);
  draw_matches(out, corner);
  for (const Half& half : halves)
    if (!half.missing.empty()) draw_missing(out, half.missing, half.box);
  for (const Words& words : words_) out.text(words.at + corner, words.text, words.style);
}

void PairLayout::draw_matches(Drawing& out, const Vector2& corner) const {
  struct Match {
    Vector2 a, b;
    double along;  // the place across the lines, by which they are coloured
    bool hollow;
  };
  std::vector<Match> inliers, others;
  for (const PairPicture::Point& point : pair_.points) {
    const Vector2 a = at_left(point.left), b = at_right(point.right);
    if (!left_.contains(a) || !right_.contains(b)) continue;  // projected to beside the picture
    (point.inlier ? inliers : others).push_back({a + corner, b + corner, stacked_ ? a.x() : a.y(), point.beside});
  }
  const auto across = [](const Match& x, const Match& y) { return x.along < y.along; };
  std::stable_sort(inliers.begin(), inliers.end(), across);
  std::stable_sort(others.begin(), others.end(), across);
  for (const Match& match : thinned_out(others, kMaxOutlierLines))
    out.line(match.a, match.b, {kOutlierColour, 0.8, 1, 3});
  for (const Match& match : others)
    for (const Vector2& end : {match.a, match.b}) draw_ring(out, end, 1.6, {kOutlierColour, 0.9, 1, 0});

  // Neighbours have neighbouring colours, so that a line can be followed, and lines that cross can be told apart.
  struct Inlier {
    Match match;
    Colour colour;
  };
  std::vector<Inlier> coloured;
  for (std::size_t i = 0; i < inliers.size(); ++i)
    coloured.push_back(
        {inliers[i],
         picture_scale(inliers.size() < 2 ? 1 : static_cast<double>(i) / static_cast<double>(inliers.size() - 1))});
  const std::vector<Inlier> joined = thinned_out(coloured, kMaxInlierLines);
  for (const Inlier& inlier : joined) {
    out.line(inlier.match.a, inlier.match.b, {kDarkColour, 2.2, 0.55, 0});
    out.line(inlier.match.a, inlier.match.b, {inlier.colour, 1.2, 1, 0});
  }
  for (const Inlier& inlier : coloured)
    for (const Vector2& end : {inlier.match.a, inlier.match.b})
      draw_match_end(out, end, inlier.match.hollow, inlier.colour);
}

}  // namespace relmap::client
