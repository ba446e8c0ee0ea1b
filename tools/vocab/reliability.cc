#include "tools/vocab/reliability.h"

#include <algorithm>
#include <cmath>

#include "proto/base/printf_text.h"

namespace relmap::vocab {
namespace {

constexpr double kSide = 420, kLeft = 60, kTop = 24, kRight = 330, kBelow = 50;  // pixels
constexpr std::size_t kMinPredictions = 5;                                       // predictions that make a dot
constexpr const char* kColours[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#8c564b", "#17becf"};

double x_of(double p) { return kLeft + p * kSide; }
double y_of(double p) { return kTop + (1 - p) * kSide; }

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return printf_text("<text x='%.1f' y='%.1f' text-anchor='%s'>", x, y, anchor) + text + "</text>\n";
}

std::string axes() {
  std::string svg = printf_text("<rect x='%g' y='%g' width='%g' height='%g' fill='none' stroke='#888'/>\n", kLeft, kTop,
                                kSide, kSide) +
                    printf_text("<line x1='%g' y1='%g' x2='%g' y2='%g' stroke='#bbb' stroke-dasharray='5 4'/>\n",
                                x_of(0), y_of(0), x_of(1), y_of(1));
  for (int tenth = 0; tenth <= 10; tenth += 2) {
    const std::string label = printf_text("%.1f", tenth / 10.0);
    svg += text_at(x_of(tenth / 10.0), kTop + kSide + 18, "middle", label);
    svg += text_at(kLeft - 8, y_of(tenth / 10.0) + 4, "end", label);
  }
  return svg + text_at(kLeft + kSide / 2, kTop + kSide + 38, "middle", "probability that was given") +
         printf_text(
             "<text transform='translate(%g %g) rotate(-90)' text-anchor='middle'>share that came true</text>\n", 18.0,
             kTop + kSide / 2);
}

}  // namespace

Reliability reliability(std::span<const Prediction> predictions, double min_probability) {
  Reliability result;
  for (const Prediction& prediction : predictions) {
    if (prediction.probability < min_probability) continue;
    const auto count = static_cast<double>(result.bins.size());
    auto& bin = result.bins[static_cast<std::size_t>(std::clamp(prediction.probability * count, 0.0, count - 1))];
    ++bin.predictions;
    ++result.predictions;
    bin.said += prediction.probability;
    bin.came_true += prediction.right;
  }
  for (auto& bin : result.bins) {
    result.error +=
        std::abs(bin.said - bin.came_true) / static_cast<double>(std::max<std::size_t>(1, result.predictions));
    if (bin.predictions == 0) continue;
    bin.said /= static_cast<double>(bin.predictions);
    bin.came_true /= static_cast<double>(bin.predictions);
  }
  return result;
}

std::string draw(const std::vector<ReliabilityCurve>& curves) {
  std::string svg = printf_text(
      "<svg xmlns='http://www.w3.org/2000/svg' width='%g' height='%g' font-family='sans-serif' font-size='13'>\n"
      "<rect width='100%%' height='100%%' fill='white'/>\n",
      kLeft + kSide + kRight, kTop + kSide + kBelow);
  svg += axes();
  std::size_t colour = 0;
  for (const auto& [name, reliability] : curves) {
    const char* stroke = kColours[colour % std::size(kColours)];
    std::string line;
    for (const auto& bin : reliability.bins) {
      if (bin.predictions < kMinPredictions) continue;
      line += printf_text("%.1f,%.1f ", x_of(bin.said), y_of(bin.came_true));
      svg += printf_text("<circle cx='%.1f' cy='%.1f' r='%.1f' fill='%s' fill-opacity='0.7'/>\n", x_of(bin.said),
                         y_of(bin.came_true), std::min(12.0, 2 + std::sqrt(static_cast<double>(bin.predictions)) / 3),
                         stroke);
    }
    svg += "<polyline points='" + line + printf_text("' fill='none' stroke='%s' stroke-width='1.5'/>\n", stroke);
    const double y = kTop + 16 + 22 * static_cast<double>(colour++);
    svg += printf_text("<circle cx='%g' cy='%g' r='5' fill='%s'/>\n", kLeft + kSide + 20, y - 4, stroke);
    svg += text_at(kLeft + kSide + 32, y, "start",
                   name + printf_text(": %zu predictions, off by %.3f", reliability.predictions, reliability.error));
  }
  return svg + "</svg>\n";
}

}  // namespace relmap::vocab
