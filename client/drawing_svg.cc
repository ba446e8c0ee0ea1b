#include <cmath>

#include "client/drawing.h"
#include "client/picture_bytes.h"
#include "proto/base/base64.h"
#include "proto/base/markup.h"
#include "proto/base/printf_text.h"

namespace relmap::client {
namespace {

constexpr double kPixelsPerPoint = 2;  // of pictures: what a sharp screen shows

// Widths of ' ' to '~', in thousandths of the em.
constexpr int kDejaVuWidths[] = {317,  400, 459, 837, 636, 950, 779, 274, 390, 390, 500, 837, 317, 360, 317, 336,
                                 636,  636, 636, 636, 636, 636, 636, 636, 636, 636, 336, 336, 837, 837, 837, 530,
                                 1000, 684, 686, 698, 770, 631, 575, 774, 751, 294, 294, 655, 557, 862, 748, 787,
                                 603,  787, 694, 634, 610, 731, 684, 988, 685, 610, 685, 390, 336, 390, 837, 500,
                                 500,  612, 634, 549, 634, 615, 352, 634, 633, 277, 277, 579, 277, 974, 633, 611,
                                 634,  634, 411, 520, 392, 633, 591, 817, 591, 591, 524, 636, 336, 636, 837};
constexpr int kDejaVuBoldWidths[] = {348,  456, 520, 837, 695, 1001, 872, 306,  457, 457, 522, 837, 379, 415,  379, 365,
                                     695,  695, 695, 695, 695, 695,  695, 695,  695, 695, 399, 399, 837, 837,  837, 580,
                                     1000, 773, 762, 733, 830, 683,  683, 820,  836, 372, 372, 774, 637, 995,  836, 850,
                                     732,  850, 770, 720, 682, 812,  773, 1103, 770, 724, 725, 457, 365, 457,  837, 500,
                                     500,  674, 715, 592, 715, 678,  435, 715,  711, 342, 342, 665, 342, 1041, 711, 687,
                                     715,  715, 493, 595, 478, 711,  651, 923,  645, 651, 582, 711, 365, 711,  837};

std::string colour_text(Colour c) { return printf_text("#%02x%02x%02x", c.red, c.green, c.blue); }

class SvgDrawing : public Drawing {
 public:
  SvgDrawing(double width, double height, Colour paper) {
    body_ = printf_text(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" viewBox=\"0 0 %g %g\" "
        "font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n",
        width, height, width, height);
    rectangle({0, 0}, {width, height}, paper, 1);
  }

  void polyline(const std::vector<Vector2>& points, const Stroke& stroke) override {
    if (points.size() < 2) return;
    body_ += "<polyline points=\"" + list(points) + "\" fill=\"none\" stroke=\"" + colour_text(stroke.colour) +
             printf_text("\" stroke-width=\"%.2f\" stroke-linejoin=\"round\"", stroke.width);
    if (stroke.dash > 0)
      body_ += printf_text(" stroke-dasharray=\"%.2f\"", stroke.dash);
    else
      body_ += " stroke-linecap=\"round\"";
    if (stroke.opacity < 1) body_ += printf_text(" stroke-opacity=\"%.2f\"", stroke.opacity);
    body_ += "/>\n";
  }

  void polygon(const std::vector<Vector2>& points, Colour fill, double opacity) override {
    body_ += "<polygon points=\"" + list(points) + "\" fill=\"" + colour_text(fill) + "\"";
    if (opacity < 1) body_ += printf_text(" fill-opacity=\"%.2f\"", opacity);
    body_ += "/>\n";
  }

  void disc(const Vector2& middle, double radius, Colour fill, double rim, Colour rim_colour) override {
    body_ += printf_text("<circle cx=\"%.2f\" cy=\"%.2f\" r=\"%.2f\" fill=\"", middle.x(), middle.y(), radius) +
             colour_text(fill) + "\"";
    if (rim > 0) body_ += printf_text(" stroke-width=\"%.2f\" stroke=\"", rim) + colour_text(rim_colour) + "\"";
    body_ += "/>\n";
  }

  void text(const Vector2& at, const std::string& utf8, const TextStyle& style) override {
    const char* anchor = style.anchor == Anchor::kLeft ? "start" : style.anchor == Anchor::kMiddle ? "middle" : "end";
    body_ += printf_text("<text x=\"%.2f\" y=\"%.2f\" font-size=\"%.2f\" text-anchor=\"%s\"%s fill=\"", at.x(), at.y(),
                         style.size, anchor, style.bold ? " font-weight=\"bold\"" : "") +
             colour_text(style.colour) + "\"";
    if (style.halo > 0)
      body_ += printf_text(" stroke=\"#ffffff\" stroke-width=\"%.2f\" stroke-linejoin=\"round\" paint-order=\"stroke\"",
                           2 * style.halo);
    body_ += ">" + markup_text(utf8) + "</text>\n";
  }

  // An upper bound: it is not known which of the fonts the reader has, and DejaVu Sans is the widest of them.
  double text_width(const std::string& utf8, const TextStyle& style) const override {
    int thousandths = 0;
    for (const char c : utf8) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte >= 0x20 && byte < 0x7F)
        thousandths += (style.bold ? kDejaVuBoldWidths : kDejaVuWidths)[byte - 0x20];
      else if ((byte & 0xC0) != 0x80)
        thousandths += 1000;  // a letter beyond ASCII: as wide as a Chinese one, wider than Latin and Cyrillic ones
    }
    return thousandths * 1e-3 * style.size;
  }

  Status picture(const Vector2& corner, const Vector2& size, const std::string& file) override {
    const auto bytes = reduced_picture(file, static_cast<int>(std::ceil(kPixelsPerPoint * size.x())));
    if (!bytes.ok()) return bytes.status();
    body_ += printf_text(
        "<image x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" preserveAspectRatio=\"none\" "
        "style=\"image-orientation:none\" href=\"data:image/%s;base64,",
        corner.x(), corner.y(), size.x(), size.y(), is_png(*bytes) ? "png" : "jpeg");
    body_ += base64(*bytes) + "\"/>\n";
    return {};
  }

  Result<std::string> file() const override { return body_ + "</svg>\n"; }

 private:
  static std::string list(const std::vector<Vector2>& points) {
    std::string out;
    for (const Vector2& p : points) out += printf_text("%s%.2f,%.2f", out.empty() ? "" : " ", p.x(), p.y());
    return out;
  }
  std::string body_;
};

}  // namespace

std::unique_ptr<Drawing> make_svg_drawing(double width, double height, Colour paper) {
  return std::make_unique<SvgDrawing>(width, height, paper);
}

}  // namespace relmap::client
