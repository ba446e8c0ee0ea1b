#include "client/map_picture.h"

#include <algorithm>
#include <vector>

#include "client/drawing.h"
#include "client/map_colours.h"
#include "client/map_contents.h"
#include "client/map_legend.h"
#include "client/map_panel.h"
#include "client/text_wrap.h"
#include "proto/base/number_text.h"

namespace relmap::client {
namespace {

constexpr Colour kPaper{252, 252, 250};
constexpr double kMargin = 36, kLegendWidth = 236, kGap = 28, kPanelGap = 22, kCaptionLine = 19;
constexpr double kMaxHeightAlone = 640, kMaxHeightFirst = 420, kMinHeight = 110;  // of plans
constexpr double kLegendShare = 1.25;  // of the height of the plans: a longer legend does not stand beside them
constexpr std::size_t kMaxPanels = 24;

const TextStyle kTitle{.size = 26, .colour = kInkColour, .bold = true}, kSubtitle{.size = 16, .colour = kFaintColour},
    kNote{.size = 16, .colour = kInkColour}, kPartTitle{.size = 15, .colour = kInkColour, .bold = true},
    kCaption{.size = 13, .colour = kFaintColour};

// The number of panels in each row of the page: the first part has a row to itself.
std::vector<std::size_t> columns_of_rows(std::size_t shown) {
  std::vector<std::size_t> rows{1};
  const std::size_t others = shown - 1, columns = others <= 4 ? 2 : others <= 9 ? 3 : 4;
  for (std::size_t left = others; left > 0; left -= std::min(left, columns)) rows.push_back(std::min(left, columns));
  return rows;
}

std::size_t keyframes_of(const MapPicture::Part& part) {
  return part.keyframes > 0 ? part.keyframes : part.frames.size();
}

// Lays out and draws a page: title, panels of the parts, legend.
class Composer {
 public:
  Composer(const MapPicture& picture, const Drawing& measure)
      : picture_(picture),
        measure_(measure),
        contents_(picture),
        column_(picture.width - 2 * kMargin - kLegendWidth - kGap),
        legend_(contents_, measure, kLegendWidth) {
    lay_out_header();
    lay_out_panels(/*legend_beside=*/true);
    const double beside = legend_.height(1);
    if (beside <= kLegendShare * (panels_bottom_ - top_)) {
      legend_at_ = {kMargin + column_ + kGap, top_};
      height_ = std::max(panels_bottom_, top_ + beside) + kMargin - 4;
      return;
    }
    // Beside the map, the legend would leave most of the page empty: it goes below, and the map gets its room.
    column_ = picture.width - 2 * kMargin;
    lay_out_panels(/*legend_beside=*/false);
    columns_ = static_cast<std::size_t>((column_ + kGap) / (kLegendWidth + kGap));
    legend_at_ = {kMargin, panels_bottom_ + kPanelGap};
    height_ = legend_at_.y() + legend_.height(columns_) + kMargin - 4;
  }

  double height() const { return height_; }

  void draw(Drawing& out) const {
    for (const Line& line : header_) out.text(line.at, line.text, line.style);
    for (const Panel& panel : panels_) {
      for (const Line& line : panel.caption) out.text(line.at, line.text, line.style);
      panel.map.draw(out, panel.area);
    }
    legend_.draw(out, legend_at_, columns_, kLegendWidth + kGap);
  }

 private:
  struct Line {
    Vector2 at;
    std::string text;
    TextStyle style;
  };
  struct Panel {
    MapPanel map;
    std::vector<Line> caption;
    Box area;
  };

  void lay_out_header() {
    const double width = picture_.width - 2 * kMargin;
    double y = kMargin;
    const auto add = [&](const std::string& text, const TextStyle& style, double line_height) {
      if (text.empty()) return;
      for (const std::string& line : wrap(measure_, text, style, width)) {
        header_.push_back({{kMargin, y + 0.7 * style.size}, line, style});
        y += line_height;
      }
    };
    add(picture_.title, kTitle, 34);
    add(picture_.subtitle, kSubtitle, 24);
    const std::size_t parts = picture_.parts.size();
    if (parts > 1)
      add(counted_text(parts, "part") +
              " that nothing connects: their position relative to each other is not known. Each is drawn in a frame of "
              "its own, at a scale of its own.",
          kNote, 24);
    if (parts > kMaxPanels)
      add(counted_text(parts - kMaxPanels, "part") + " of " +
              counted_text(keyframes_of(picture_.parts[kMaxPanels]), "keyframe") + " or fewer are not drawn.",
          kNote, 24);
    top_ = y + (header_.empty() ? 0 : 6);
  }

  std::vector<Line> caption_of(std::size_t part, double left, double& y, double width) const {
    std::vector<Line> lines;
    const auto add = [&](const std::string& text, const TextStyle& style) {
      for (const std::string& line : wrap(measure_, text, style, width)) {
        lines.push_back({{left, y + 14}, line, style});
        y += kCaptionLine;
      }
    };
    const MapPicture::Part& shown = picture_.parts[part];
    add("Part " + std::to_string(part + 1) + " of " + std::to_string(picture_.parts.size()), kPartTitle);
    add(counted_text(keyframes_of(shown), "keyframe") + " in the frame of " + shown.root.to_string() +
            "; position relative to the other parts unknown",
        kCaption);
    y += 2;
    return lines;
  }

  // A plan that stands alone may be as high as the legend beside it.
  static double alone_height(double legend) {
    return std::clamp(legend - 40, kMaxHeightAlone, kLegendShare * kMaxHeightAlone - 40);
  }

  // Puts the panels below the header, `column_` wide.
  void lay_out_panels(bool legend_beside) {
    panels_.clear();
    width_of_others_ = 0;
    const std::size_t shown = std::min(picture_.parts.size(), kMaxPanels);
    double y = top_;
    std::size_t part = 0;
    for (const std::size_t columns : columns_of_rows(shown)) {
      const bool first = part == 0;
      // The panels of a row that is not full are as wide as those above.
      if (!first && width_of_others_ == 0)
        width_of_others_ = (column_ - kPanelGap * static_cast<double>(columns - 1)) / static_cast<double>(columns);
      const double width = first || shown == 2 ? column_ : width_of_others_;
      const double beside = legend_beside ? legend_.height(1) : 0;
      const double max_height = shown == 1            ? alone_height(beside)
                                : first || shown == 2 ? kMaxHeightFirst
                                                      : 0.75 * width;
      std::vector<Panel> row;
      double plans = kMinHeight, captions_end = y;
      for (std::size_t k = 0; k < columns; ++k, ++part) {
        const double left = kMargin + static_cast<double>(k) * (width + kPanelGap);
        double below = y;
        std::vector<Line> caption;
        if (shown > 1) caption = caption_of(part, left, below, width);
        row.push_back(
            {MapPanel(contents_, part, width, max_height), std::move(caption), {{left, 0}, {left + width, 0}}});
        plans = std::max(plans, row.back().map.plan_height());
        captions_end = std::max(captions_end, below);
      }
      if (shown == 1 && beside <= kLegendShare * plans) plans = std::max(plans, beside);
      for (Panel& panel : row) {
        panel.area.low.y() = captions_end;
        panel.area.high.y() = captions_end + plans;
        panels_.push_back(std::move(panel));
      }
      y = captions_end + plans + MapPanel::kScaleHeight + kPanelGap;
    }
    panels_bottom_ = y - kPanelGap;
  }

  const MapPicture& picture_;
  const Drawing& measure_;
  const MapContents contents_;
  double column_ = 0;  // the width of the panels
  const MapLegend legend_;
  std::vector<Line> header_;
  std::vector<Panel> panels_;
  double top_ = 0, panels_bottom_ = 0, height_ = 0, width_of_others_ = 0;
  Vector2 legend_at_ = Vector2::Zero();
  std::size_t columns_ = 1;  // of the legend
};

Status check(const MapPicture& picture) {
  const auto finite = [](const SE3& pose) { return pose.t.allFinite() && pose.R.allFinite(); };
  if (picture.parts.empty()) return {Reason::EMPTY_MAP, "there is no frame to draw"};
  for (const MapPicture::Part& part : picture.parts) {
    if (part.frames.empty()) return {Reason::EMPTY_MAP, "a part has no frame to draw"};
    for (const MapPicture::Frame& frame : part.frames)
      if (!finite(frame.T_root_frame))
        return {Reason::INVALID_ARGUMENT, "the pose of frame " + frame.id.to_string() + " is not finite"};
  }
  if (picture.query && !finite(picture.query->T_frame_query))
    return {Reason::INVALID_ARGUMENT, "the pose of the query is not finite"};
  if (!(picture.width >= 600 && picture.width <= 4000 && picture.png_scale >= 0.5 && picture.png_scale <= 4))
    return {Reason::INVALID_ARGUMENT, "the page must be 600 .. 4000 points wide, of 0.5 .. 4 pixels each"};
  return {};
}

}  // namespace

Result<std::string> draw_map_picture(const MapPicture& picture, PictureFormat format) {
  if (Status status = check(picture); !status.ok()) return status;
  const auto page = [&](double width, double height) {
    return make_drawing(format, width, height, kPaper, picture.png_scale);
  };
  const auto measure = page(1, 1);  // letters have the same width on a page of any size
  const Composer composer(picture, *measure);
  const auto drawing = page(picture.width, composer.height());
  composer.draw(*drawing);
  return drawing->file();
}

Status write_map_picture(const MapPicture& picture, const std::string& path) {
  const auto format = picture_format(path);
  if (!format.ok()) return format.status();
  const auto bytes = draw_map_picture(picture, *format);
  if (!bytes.ok()) return bytes.status();
  return write_file(path, *bytes);
}

}  // namespace relmap::client
