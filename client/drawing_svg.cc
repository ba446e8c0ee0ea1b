#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "client/drawing.h"

namespace relmap {
namespace {

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (static_cast<unsigned char>(c) < 0x20)
      out += ' ';  // not allowed in XML
    else
      out += c;
  }
  return out;
}

std::string hex(Colour c) { return format("#%02x%02x%02x", c.red, c.green, c.blue); }

class SvgDrawing : public Drawing {
 public:
  SvgDrawing(double width, double height, Colour paper) {
    body_ = format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" viewBox=\"0 0 %g %g\" "
        "font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n",
        width, height, width, height);
    rectangle({0, 0}, {width, height}, paper, 1);
  }

  void polyline(const std::vector<Vector2>& points, const Stroke& stroke) override {
    if (points.size() < 2) return;
    body_ += "<polyline points=\"" + list(points) + "\" fill=\"none\" stroke=\"" + hex(stroke.colour) +
             format("\" stroke-width=\"%.2f\" stroke-linejoin=\"round\"", stroke.width);
    if (stroke.dash > 0)
      body_ += format(" stroke-dasharray=\"%.2f\"", stroke.dash);
    else
      body_ += " stroke-linecap=\"round\"";
    if (stroke.opacity < 1) body_ += format(" stroke-opacity=\"%.2f\"", stroke.opacity);
    body_ += "/>\n";
  }

  void polygon(const std::vector<Vector2>& points, Colour fill, double opacity) override {
    body_ += "<polygon points=\"" + list(points) + "\" fill=\"" + hex(fill) + "\"";
    if (opacity < 1) body_ += format(" fill-opacity=\"%.2f\"", opacity);
    body_ += "/>\n";
  }

  void disc(const Vector2& middle, double radius, Colour fill, double rim, Colour rim_colour) override {
    body_ +=
        format("<circle cx=\"%.2f\" cy=\"%.2f\" r=\"%.2f\" fill=\"", middle.x(), middle.y(), radius) + hex(fill) + "\"";
    if (rim > 0) body_ += format(" stroke-width=\"%.2f\" stroke=\"", rim) + hex(rim_colour) + "\"";
    body_ += "/>\n";
  }

  void text(const Vector2& at, const std::string& utf8, const TextStyle& style) override {
    const char* anchor = style.anchor == Anchor::kLeft ? "start" : style.anchor == Anchor::kMiddle ? "middle" : "end";
    body_ += format("<text x=\"%.2f\" y=\"%.2f\" font-size=\"%.2f\" text-anchor=\"%s\"%s fill=\"", at.x(), at.y(),
                    style.size, anchor, style.bold ? " font-weight=\"bold\"" : "") +
             hex(style.colour) + "\"";
    if (style.halo > 0)
      body_ += format(" stroke=\"#ffffff\" stroke-width=\"%.2f\" stroke-linejoin=\"round\" paint-order=\"stroke\"",
                      2 * style.halo);
    body_ += ">" + escape(utf8) + "</text>\n";
  }

  double text_width(const std::string& utf8, const TextStyle& style) const override {
    int letters = 0;
    for (const char c : utf8) letters += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    return letters * style.size * (style.bold ? 0.58 : 0.53);  // of Helvetica, on average
  }

  Status save(const std::string& path) const override {
    std::ofstream out(path, std::ios::binary);
    out << body_ << "</svg>\n";
    out.close();
    if (!out) return {Reason::IO_ERROR, "cannot write " + path + ": " + std::strerror(errno)};
    return {};
  }

 private:
  static std::string list(const std::vector<Vector2>& points) {
    std::string out;
    for (const Vector2& p : points) out += format("%s%.2f,%.2f", out.empty() ? "" : " ", p.x(), p.y());
    return out;
  }
  std::string body_;
};

}  // namespace

std::unique_ptr<Drawing> make_svg_drawing(double width, double height, Colour paper) {
  return std::make_unique<SvgDrawing>(width, height, paper);
}

}  // namespace relmap
