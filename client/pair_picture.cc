#include "client/pair_picture.h"

#include <algorithm>
#include <memory>

#include "client/map_colours.h"
#include "client/pair_layout.h"
#include "client/text_wrap.h"

namespace relmap::client {
namespace {

constexpr Colour kPairPaper{252, 252, 250}, kRowRule{214, 214, 208}, kTrough{230, 230, 226};
constexpr double kPairMargin = 28, kWordsGap = 26;
constexpr double kPairWidth = 2 * 640 + 14;  // of the pictures of a single pair
constexpr double kRowPairs = 860, kRowWords = 380, kRowGap = 26;
constexpr double kOtherWidth = 320;
constexpr double kBar = 90;

const TextStyle kPairTitle{.size = 22, .colour = kInkColour, .bold = true},
    kRowTitle{.size = 17, .colour = kInkColour, .bold = true}, kPairNote{.size = 14, .colour = kInkColour},
    kGaugeStyle{.size = 16, .colour = kInkColour, .bold = true}, kDoubtStyle{.size = 13, .colour = kInkColour};

// A column of a title, gauges and notes.
class PairWords {
 public:
  PairWords(const PairPicture& pair, const Drawing& measure, double width, const TextStyle& title) {
    add(measure, pair.title, title, 0, width, 1.25);
    if (!pair.title.empty()) height_ += 4;
    for (const PairPicture::Gauge& gauge : pair.gauges) {
      const TextStyle& style = gauge.strong ? kGaugeStyle : kDoubtStyle;
      const double tall = gauge.strong ? 12 : 8, bar = gauge.strong ? kBar : 0.6 * kBar;
      bars_.push_back({{0, height_ + 0.35 * style.size - tall / 2 + 4}, {bar, tall}, gauge.value, gauge.colour});
      add(measure, gauge.text, style, kBar + 10, width - kBar - 10, 1.3);
      height_ += gauge.strong ? 5 : 2;
    }
    if (!pair.gauges.empty()) height_ += 6;
    for (const std::string& note : pair.notes) {
      add(measure, note, kPairNote, 0, width, 1.3);
      height_ += 5;
    }
  }

  double height() const { return height_; }
  void draw(Drawing& out, const Vector2& corner) const {
    for (const Bar& bar : bars_) {
      out.rectangle(corner + bar.at, bar.size, kTrough, 1);
      const double filled = std::clamp(bar.value, 0.0, 1.0) * bar.size.x();
      if (filled > 0) out.rectangle(corner + bar.at, {std::max(filled, 1.0), bar.size.y()}, bar.colour, 1);
    }
    for (const Line& line : lines_) out.text(corner + line.at, line.text, line.style);
  }

 private:
  struct Line {
    Vector2 at;
    std::string text;
    TextStyle style;
  };
  struct Bar {
    Vector2 at, size;
    double value;
    Colour colour;
  };
  void add(const Drawing& measure, const std::string& text, const TextStyle& style, double left, double width,
           double spacing) {
    if (text.empty()) return;
    for (const std::string& line : wrap(measure, text, style, width)) {
      lines_.push_back({{left, height_ + 0.85 * style.size}, line, style});
      height_ += spacing * style.size;
    }
  }

  std::vector<Line> lines_;
  std::vector<Bar> bars_;
  double height_ = 0;
};

}  // namespace

Result<std::string> draw_pair(const PairPicture& pair, PictureFormat format) {
  const auto measure = make_drawing(format, 1, 1, kPairPaper, 1);
  const PairLayout pictures(pair, *measure, kPairWidth);
  PairPicture heading, body, other;
  heading.title = pair.title;
  body.gauges = pair.gauges;
  body.notes = pair.notes;
  Vector2 small = Vector2::Zero();
  if (pair.other) {
    other.notes = pair.other->details;
    other.notes.insert(other.notes.begin(), pair.other->title);
    const Vector2 camera = camera_size(*pair.other);
    small = std::min(kOtherWidth / camera.x(), 0.75 * kOtherWidth / camera.y()) * camera;
  }
  const double column = pair.other ? kPairWidth - kOtherWidth - kWordsGap : kPairWidth;
  const PairWords head(heading, *measure, kPairWidth, kPairTitle), below(body, *measure, column, kPairTitle),
      beside(other, *measure, kOtherWidth, kPairTitle);
  const double top = kPairMargin + head.height() + 4, under = top + pictures.height() + 10;
  const double end = under + std::max(below.height(), small.y() + 6 + beside.height());
  const auto out = make_drawing(format, kPairWidth + 2 * kPairMargin, end + kPairMargin, kPairPaper, 1);
  head.draw(*out, {kPairMargin, kPairMargin});
  pictures.draw(*out, {kPairMargin, top});
  below.draw(*out, {kPairMargin, under});
  if (pair.other) {
    const Vector2 corner(kPairMargin + column + kWordsGap, under);
    draw_side(*out, *pair.other, {corner, corner + small});
    beside.draw(*out, corner + Vector2(0, small.y() + 6));
  }
  return out->file();
}

Result<std::string> draw_pair_sheet(const PairSheet& sheet, PictureFormat format) {
  if (sheet.pairs.empty()) return {Reason::EMPTY_MAP, "there is no pair of pictures to draw"};
  const auto measure = make_drawing(format, 1, 1, kPairPaper, 1);
  const double width = kRowPairs + kWordsGap + kRowWords;
  PairPicture heading;
  heading.title = sheet.title;
  if (!sheet.subtitle.empty()) heading.notes = {sheet.subtitle};
  const PairWords head(heading, *measure, width, kPairTitle);
  struct Row {
    PairLayout pictures;
    PairWords words;
    double top;
  };
  std::vector<Row> rows;
  double y = kPairMargin + head.height() + (head.height() > 0 ? 12 : 0);
  for (const PairPicture& pair : sheet.pairs) {
    rows.push_back({PairLayout(pair, *measure, kRowPairs), PairWords(pair, *measure, kRowWords, kRowTitle), y});
    y += std::max(rows.back().pictures.height(), rows.back().words.height()) + kRowGap;
  }
  const auto out = make_drawing(format, width + 2 * kPairMargin, y - kRowGap + kPairMargin, kPairPaper, 1);
  head.draw(*out, {kPairMargin, kPairMargin});
  for (const Row& row : rows) {
    if (&row != &rows.front())
      out->line({kPairMargin, row.top - kRowGap / 2}, {kPairMargin + width, row.top - kRowGap / 2},
                {kRowRule, 1, 1, 0});
    row.pictures.draw(*out, {kPairMargin, row.top});
    row.words.draw(*out, {kPairMargin + kRowPairs + kWordsGap, row.top});
  }
  return out->file();
}

}  // namespace relmap::client
