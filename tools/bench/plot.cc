#include "tools/bench/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "client/drawing.h"

namespace relmap::bench {
namespace {

constexpr double kWidth = 760, kHeight = 420, kLeft = 76, kRight = 24, kTop = 48, kBottom = 56;
constexpr client::Colour kInk{40, 44, 52}, kGrid{222, 226, 232}, kPaper{255, 255, 255};
constexpr std::array<client::Colour, 5> kColours = {client::Colour{31, 98, 189}, client::Colour{208, 84, 28},
                                                    client::Colour{32, 138, 82}, client::Colour{134, 72, 176},
                                                    client::Colour{120, 120, 120}};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// One axis: the positions of values on the page, and its tick marks.
class Axis {
 public:
  Axis(bool logarithmic, double from, double to) : log_(logarithmic), from_(from), to_(to) {}

  void include(double value) {
    if (!std::isfinite(value) || (log_ && value <= 0)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  // Rounds the range to whole ticks.
  void round_outwards() {
    if (low_ > high_) low_ = 1, high_ = 2;
    if (log_) {
      low_ = std::pow(10, std::floor(std::log10(low_) + 1e-9));
      high_ = std::pow(10, std::ceil(std::log10(high_) - 1e-9));
      if (low_ == high_) high_ *= 10;
      for (double mark = low_; mark <= high_ * 1.0001; mark *= 10) marks_.push_back(mark);
      return;
    }
    low_ = std::min(low_, 0.0);
    const double raw = std::max((high_ - low_) / 6, 1e-12);
    const double unit = std::pow(10, std::floor(std::log10(raw)));
    const double step = unit * (raw / unit > 5 ? 10 : raw / unit > 2 ? 5 : raw / unit > 1 ? 2 : 1);
    low_ = std::floor(low_ / step) * step;
    high_ = std::ceil(high_ / step - 1e-9) * step;
    if (low_ == high_) high_ += step;
    for (double mark = low_; mark <= high_ + step / 2; mark += step)
      marks_.push_back(std::abs(mark) < step / 1e6 ? 0 : mark);
  }
  bool shows(double value) const { return std::isfinite(value) && (!log_ || value > 0); }
  double at(double value) const {
    const double t = log_ ? std::log(value / low_) / std::log(high_ / low_) : (value - low_) / (high_ - low_);
    return from_ + t * (to_ - from_);
  }
  const std::vector<double>& marks() const { return marks_; }

 private:
  const bool log_;
  const double from_, to_;
  double low_ = 1e300, high_ = -1e300;
  std::vector<double> marks_;
};

}  // namespace

Curve curve_by_step(std::string name, std::vector<double> y) {
  std::vector<double> x(y.size());
  std::iota(x.begin(), x.end(), 0.0);
  return {std::move(name), std::move(x), std::move(y)};
}

void save_plot(const Plot& plot, const std::string& path) {
  if (path.empty()) return;
  Axis x(plot.log_x, kLeft, kWidth - kRight), y(plot.log_y, kHeight - kBottom, kTop);
  for (const Curve& curve : plot.curves) {
    for (const double value : curve.x) x.include(value);
    for (const double value : curve.y) y.include(value);
  }
  x.round_outwards();
  y.round_outwards();

  const auto page = path.ends_with(".png") ? client::make_png_drawing(kWidth, kHeight, kPaper, 2)
                                           : client::make_svg_drawing(kWidth, kHeight, kPaper);
  const client::Stroke grid{kGrid, 1};
  const client::TextStyle small{13, kInk};
  for (const double mark : x.marks()) {
    page->line({x.at(mark), kTop}, {x.at(mark), kHeight - kBottom}, grid);
    page->text({x.at(mark), kHeight - kBottom + 18}, number(mark), {13, kInk, false, client::Anchor::kMiddle});
  }
  for (const double mark : y.marks()) {
    page->line({kLeft, y.at(mark)}, {kWidth - kRight, y.at(mark)}, grid);
    page->text({kLeft - 8, y.at(mark) + 4}, number(mark), {13, kInk, false, client::Anchor::kRight});
  }
  page->text({kLeft, 20}, plot.title, {16, kInk, true});
  page->text({kLeft - 60, kTop - 10}, plot.y_label, small);
  page->text({kWidth - kRight, kHeight - 14}, plot.x_label, {13, kInk, false, client::Anchor::kRight});

  double name_at = kWidth - kRight;
  for (std::size_t c = plot.curves.size(); c-- > 0;) {
    const Curve& curve = plot.curves[c];
    const client::Colour colour = kColours[c % kColours.size()];
    std::vector<Vector2> points;
    for (std::size_t k = 0; k < std::min(curve.x.size(), curve.y.size()); ++k)
      if (x.shows(curve.x[k]) && y.shows(curve.y[k])) points.emplace_back(x.at(curve.x[k]), y.at(curve.y[k]));
    if (curve.dots)
      for (const Vector2& point : points) page->disc(point, 2.2, colour, 0, colour);
    else
      page->polyline(points, {colour, 1.8});
    page->text({name_at, kTop - 10}, curve.name, {13, colour, true, client::Anchor::kRight});
    name_at -= page->text_width(curve.name, {13, colour, true}) + 20;
  }
  if (Status saved = page->save(path); !saved.ok()) throw StatusError(saved);
}

}  // namespace relmap::bench
