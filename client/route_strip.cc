#include "client/route_strip.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "client/label_placement.h"
#include "client/map_colours.h"
#include "client/text_wrap.h"
#include "proto/base/number_text.h"
#include "proto/base/printf_text.h"

namespace relmap::client {
namespace {

constexpr Colour kStripPaper{252, 252, 250}, kStripRule{214, 214, 208}, kNoViewColour{226, 227, 224};
constexpr double kStripWidth = 1200, kStripMargin = 36, kAxisRoom = 62, kStopGap = 10, kProfileHeight = 190;
constexpr std::size_t kStopsPerRow = 8;

const TextStyle kStripTitle{.size = 24, .colour = kInkColour, .bold = true},
    kStripSubtitle{.size = 15, .colour = kFaintColour}, kStopTitle{.size = 13, .colour = kInkColour, .bold = true},
    kStopDetail{.size = 12, .colour = kFaintColour}, kTickStyle{.size = 12, .colour = kFaintColour},
    kWayStyle{.size = 13, .colour = kInkColour};

struct StretchStyle {
  RouteStrip::StretchKind kind;
  const char* name;
  Colour colour;
  double dash;  // of the bar; 0: solid
};
constexpr std::array<StretchStyle, 3> kStretches{
    {{RouteStrip::StretchKind::kCarried, "a robot was carried here", kQueryColour, 2.5},
     {RouteStrip::StretchKind::kUnmeasured, "nothing measured this: a guess", kInkColour, 7},
     {RouteStrip::StretchKind::kLongLoop, "a loop closure longer than 5 m, passable by assumption", kLoopColour, 0}}};

// A unit of lengths, and the decimals that tell multiples of a step apart in it.
struct AxisUnit {
  double metres = 1;
  const char* name = "m";
  int decimals = 0;

  // "0.15 m"; "0" has no unit.
  std::string text(double length) const { return length == 0 ? "0" : fixed(length / metres, decimals) + " " + name; }
};
// The least decimals by which multiples of 1, 2 or 5 times a power of ten metres differ, and of other steps roughly.
AxisUnit unit_for(double step, double metres, const char* name) {
  return {metres, name, std::max(0, static_cast<int>(std::ceil(-std::log10(step / metres) - 1e-9)))};
}
// "0:07", "18:40", "2:05:00"
std::string time_of(double seconds) {
  const auto s = static_cast<long>(std::lround(std::max(0.0, seconds)));
  return s < 3600 ? printf_text("%ld:%02ld", s / 60, s % 60)
                  : printf_text("%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
}

// The smallest of 1, 2, 5 times a power of ten that divides `range` into at most `ticks`.
double tick_of(double range, int ticks) {
  if (!(range > 0)) return 1;
  const double power = std::pow(10, std::floor(std::log10(range / ticks)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (range / (factor * power) <= ticks) return factor * power;
  return 10 * power;
}

// Of distances along the route, the longest of which is `longest`.
AxisUnit distance_unit(double step, double longest) {
  return longest < 1000 ? unit_for(step, 1, "m") : unit_for(step, 1000, "km");
}
AxisUnit sigma_unit(double step, double highest) {
  return highest < 0.0995 ? unit_for(step, 0.001, "mm")
         : highest < 1    ? unit_for(step, 0.01, "cm")
                          : unit_for(step, 1, "m");
}

class StripComposer {
 public:
  StripComposer(const RouteStrip& strip, const Drawing& measure) : strip_(strip), measure_(measure) {
    for (const RouteStrip::Way& way : strip.ways)
      for (const RouteStrip::Way::Point& point : way.points) {
        length_ = std::max(length_, point.distance_m);
        if (std::isfinite(point.sigma_m)) highest_ = std::max(highest_, point.sigma_m);
      }
    length_ = std::max(length_, strip.stops.back().distance_m);
    if (!(length_ > 0)) length_ = 1;
    if (!(highest_ > 0)) highest_ = 0.01;
    distance_step_ = tick_of(length_, 8);
    ticks_ = distance_unit(distance_step_, length_);
    // Views lie between ticks, and neighbours must not seem to be at one distance.
    const double apart = length_ / static_cast<double>(std::max<std::size_t>(strip.stops.size(), 2) - 1);
    stop_distances_ = distance_unit(std::min(apart / 3, length_ < 10 ? 0.1 : 1000), length_);
    lay_out();
  }

  double height() const { return height_; }

  void draw(Drawing& out) const {
    double y = kStripMargin;
    for (const auto& [text, style] : heading_) {
      out.text({kStripMargin, y + 0.8 * style.size}, text, style);
      y += 1.4 * style.size;
    }
    draw_stops(out);
    draw_profile(out);
    draw_stretches(out);
    draw_legend(out);
  }

 private:
  void lay_out() {
    double y = kStripMargin;
    for (const auto& [text, style] :
         {std::pair(&strip_.title, kStripTitle), std::pair(&strip_.subtitle, kStripSubtitle)}) {
      if (text->empty()) continue;
      for (const std::string& line : wrap(measure_, *text, style, kStripWidth - 2 * kStripMargin)) {
        heading_.emplace_back(line, style);
        y += 1.4 * style.size;
      }
    }
    stops_top_ = y + 12;
    const std::size_t count = strip_.stops.size(), rows = (count + kStopsPerRow - 1) / kStopsPerRow;
    columns_ = (count + rows - 1) / rows;
    const double columns = static_cast<double>(std::max<std::size_t>(columns_, 4));
    cell_ = (kStripWidth - 2 * kStripMargin - kStopGap * (columns - 1)) / columns;
    for (const RouteStrip::Stop& stop : strip_.stops) {
      const auto size = picture_size(stop.picture);
      sizes_.push_back(size.ok() ? std::min(cell_ / size->x(), 0.8 * cell_ / size->y()) * *size : Vector2(0, 0));
      tall_ = std::max(tall_, sizes_.back().y());
    }
    if (tall_ == 0) tall_ = 0.5 * cell_;
    row_height_ = tall_ + 52;
    profile_top_ = stops_top_ + row_height_ * static_cast<double>(rows) + 34;
    low_ = {kStripMargin + kAxisRoom, profile_top_ + kProfileHeight};
    bars_top_ = low_.y() + 36;
    double below = bars_top_;
    for (const StretchStyle& style : kStretches)
      if (has(style.kind)) below += 20;
    legend_top_ = below + 8;
    for (const RouteStrip::Way& way : strip_.ways)
      legend_lines_ += wrap(measure_, way.name, kWayStyle, kStripWidth - 2 * kStripMargin - kAxisRoom - 50).size();
    height_ = legend_top_ + 20 * static_cast<double>(legend_lines_) + kStripMargin - 6;
  }

  bool has(RouteStrip::StretchKind kind) const {
    return std::any_of(strip_.stretches.begin(), strip_.stretches.end(),
                       [&](const RouteStrip::Stretch& stretch) { return stretch.kind == kind; });
  }
  double wide() const { return kStripWidth - kStripMargin - low_.x(); }
  double x_of(double metres) const { return low_.x() + wide() * std::clamp(metres / length_, 0.0, 1.0); }
  double y_of(double sigma) const { return low_.y() - (kProfileHeight - 14) * sigma / highest_; }

  void draw_stops(Drawing& out) const {
    for (std::size_t i = 0; i < strip_.stops.size(); ++i) {
      const RouteStrip::Stop& stop = strip_.stops[i];
      const Vector2 at(kStripMargin + static_cast<double>(i % columns_) * (cell_ + kStopGap),
                       stops_top_ + static_cast<double>(i / columns_) * row_height_);
      out.rectangle(at, {cell_, tall_}, kNoViewColour, 1);
      if (sizes_[i].x() == 0 ||
          !out.picture(at + (Vector2(cell_, tall_) - sizes_[i]) / 2, sizes_[i], stop.picture).ok()) {
        out.text(at + Vector2(cell_ / 2, tall_ / 2 + 5), "no picture",
                 {.size = 13, .colour = kFaintColour, .anchor = Anchor::kMiddle});
      }
      number(out, at + Vector2(13, 13), i);
      out.text(at + Vector2(0, tall_ + 15),
               cut(stop_distances_.text(stop.distance_m) + ", " + time_of(stop.time_s), kStopTitle), kStopTitle);
      out.text(at + Vector2(0, tall_ + 30),
               cut(stop.frame.to_string() + (stop.label.empty() ? "" : " " + stop.label), kStopDetail), kStopDetail);
      // On the axis: where the picture was taken.
      number(out, {x_of(stop.distance_m), profile_top_ - 14}, i);
      out.line({x_of(stop.distance_m), profile_top_ - 4}, {x_of(stop.distance_m), low_.y()}, {kStripRule, 1, 1, 0});
    }
  }

  std::string cut(const std::string& text, const TextStyle& style) const {
    const std::vector<std::string> lines = wrap(measure_, text, style, cell_ - measure_.text_width("...", style));
    return lines.size() < 2 ? lines.front() : lines.front() + "...";
  }

  void number(Drawing& out, const Vector2& at, std::size_t stop) const {
    out.disc(at, 9, kInkColour, 1.5, kWhiteColour);
    out.text(at + Vector2(0, 4), std::to_string(stop + 1),
             {.size = 11, .colour = kWhiteColour, .bold = true, .anchor = Anchor::kMiddle});
  }

  void draw_profile(Drawing& out) const {
    const double step = tick_of(highest_, 4);
    const AxisUnit sigmas = sigma_unit(step, highest_);
    for (double sigma = 0; sigma <= highest_ * 1.0001; sigma += step) {
      out.line({low_.x(), y_of(sigma)}, {kStripWidth - kStripMargin, y_of(sigma)}, {kStripRule, 1, 1, 0});
      out.text({low_.x() - 8, y_of(sigma) + 4}, sigmas.text(sigma),
               {.size = 12, .colour = kFaintColour, .anchor = Anchor::kRight});
    }
    for (double at = 0; at <= length_ * 1.0001; at += distance_step_)
      out.text({x_of(at), low_.y() + 17}, ticks_.text(at),
               {.size = 12, .colour = kFaintColour, .anchor = Anchor::kMiddle});
    for (std::size_t w = strip_.ways.size(); w-- > 0;) {
      std::vector<Vector2> line;
      for (const RouteStrip::Way::Point& point : strip_.ways[w].points)
        if (std::isfinite(point.sigma_m)) line.emplace_back(x_of(point.distance_m), y_of(point.sigma_m));
      if (line.size() < 2) continue;
      if (w == 0) {
        std::vector<Vector2> area = line;
        area.emplace_back(line.back().x(), low_.y());
        area.emplace_back(line.front().x(), low_.y());
        out.polygon(area, session_colour(0), 0.16);
      }
      out.polyline(line, way_stroke(w));
    }
    out.text({low_.x() + 6, profile_top_ + 12}, "standard deviation of the position relative to the start",
             {.size = 13, .colour = kInkColour, .halo = 2});
    LabelPlacement placement({{low_.x(), profile_top_ + 18}, {kStripWidth - kStripMargin, low_.y() - 2}});
    for (const RouteStrip::Mark& mark : strip_.marks) {
      const TextStyle style{.size = 13, .colour = kInkColour, .bold = true, .halo = 2};
      const Vector2 at(x_of(mark.distance_m), low_.y() - 8);
      const Box box = placement.place(at, {measure_.text_width(mark.text, style), 15});
      out.disc({at.x(), low_.y()}, 4, kInkColour, 1.5, kWhiteColour);
      out.text({box.low.x(), box.low.y() + 12}, mark.text, style);
    }
  }

  static Stroke way_stroke(std::size_t way) {
    return {way == 0 ? session_colour(0) : session_colour(way), way == 0 ? 2.4 : 1.6, 1, way == 0 ? 0.0 : 6.0};
  }

  void draw_stretches(Drawing& out) const {
    double y = bars_top_;
    for (const StretchStyle& style : kStretches) {
      if (!has(style.kind)) continue;
      double last = low_.x();
      for (const RouteStrip::Stretch& stretch : strip_.stretches) {
        if (stretch.kind != style.kind) continue;
        const double from = x_of(stretch.from_m), to = std::max(x_of(stretch.to_m), from + 3);
        out.line({from, y}, {to, y}, {style.colour, 5, 1, style.dash});
        out.rectangle({from, profile_top_}, {to - from, kProfileHeight}, style.colour, 0.10);
        last = std::max(last, to);
      }
      const double width = measure_.text_width(style.name, kTickStyle);
      const bool behind = last + 8 + width < kStripWidth - kStripMargin;
      out.text({behind ? last + 8 : kStripWidth - kStripMargin - width, behind ? y + 4 : y + 15}, style.name,
               kTickStyle);
      y += 20;
    }
  }

  void draw_legend(Drawing& out) const {
    double y = legend_top_;
    for (std::size_t w = 0; w < strip_.ways.size(); ++w) {
      out.line({low_.x(), y + 6}, {low_.x() + 34, y + 6}, way_stroke(w));
      for (const std::string& line :
           wrap(measure_, strip_.ways[w].name, kWayStyle, kStripWidth - 2 * kStripMargin - kAxisRoom - 50)) {
        out.text({low_.x() + 44, y + 11}, line, kWayStyle);
        y += 20;
      }
    }
  }

  const RouteStrip& strip_;
  const Drawing& measure_;
  std::vector<std::pair<std::string, TextStyle>> heading_;
  double length_ = 0, highest_ = 0, distance_step_ = 0;
  AxisUnit ticks_, stop_distances_;
  std::vector<Vector2> sizes_;  // of the pictures on the page; zero: there is none
  std::size_t columns_ = 1, legend_lines_ = 0;
  double stops_top_ = 0, cell_ = 0, tall_ = 0, row_height_ = 0, profile_top_ = 0, bars_top_ = 0, legend_top_ = 0,
         height_ = 0;
  Vector2 low_ = Vector2::Zero();  // where the axes of the profile meet
};

}  // namespace

std::vector<std::size_t> evenly_along(const std::vector<RouteStep>& steps, std::size_t count) {
  std::vector<std::size_t> chosen;
  if (steps.empty()) return chosen;
  const double length = steps.back().distance_m;
  count = std::max<std::size_t>(count, 2);
  for (std::size_t i = 0; i < count; ++i) {
    const double at = length * static_cast<double>(i) / static_cast<double>(count - 1);
    // The nearest step; of a route without a length, the steps by their number.
    std::size_t best = steps.size() - 1;
    if (length > 0) {
      const auto behind = std::lower_bound(steps.begin(), steps.end(), at,
                                           [](const RouteStep& step, double d) { return step.distance_m < d; });
      best = std::min(static_cast<std::size_t>(behind - steps.begin()), steps.size() - 1);
      if (best > 0 && at - steps[best - 1].distance_m < steps[best].distance_m - at) --best;
    } else {
      best = i * (steps.size() - 1) / (count - 1);
    }
    if (i + 1 == count) best = steps.size() - 1;
    if (i == 0) best = 0;
    if (chosen.empty() || best > chosen.back()) chosen.push_back(best);
  }
  return chosen;
}

std::vector<RouteStrip::Stretch> stretches_of(const std::vector<RouteStep>& steps) {
  std::vector<RouteStrip::Stretch> stretches;
  for (const auto& [kind, has] : {std::pair(RouteStrip::StretchKind::kCarried, &RouteStep::carried),
                                  std::pair(RouteStrip::StretchKind::kUnmeasured, &RouteStep::unmeasured),
                                  std::pair(RouteStrip::StretchKind::kLongLoop, &RouteStep::long_loop)}) {
    bool open = false;
    for (std::size_t i = 0; i + 1 < steps.size(); ++i) {
      if (steps[i].*has) {
        if (!open) stretches.push_back({kind, steps[i].distance_m, 0});
        stretches.back().to_m = steps[i + 1].distance_m;
      }
      open = steps[i].*has;
    }
  }
  return stretches;
}

Result<std::string> draw_route_strip(const RouteStrip& strip, PictureFormat format) {
  if (strip.stops.empty()) return {Reason::EMPTY_MAP, "the route has no frame to draw"};
  constexpr double kScale = 1.5;
  const auto measure = make_drawing(format, 1, 1, kStripPaper, kScale);
  const StripComposer composer(strip, *measure);
  const auto out = make_drawing(format, kStripWidth, composer.height(), kStripPaper, kScale);
  composer.draw(*out);
  return out->file();
}

}  // namespace relmap::client
