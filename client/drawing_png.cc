#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "client/drawing.h"
#include "client/picture_bytes.h"

namespace relmap::client {
namespace {

constexpr int kOversampling = 2;     // pixels drawn per pixel saved, along each axis
constexpr int kSubpixelBits = 4;     // of OpenCV's fixed-point coordinates
constexpr double kCapUnits = 21;     // height of a capital of OpenCV's stroke fonts at scale 1, pixels
constexpr double kCapHeight = 0.70;  // height of a capital, in ems

cv::Scalar scalar(Colour c) {
  return {static_cast<double>(c.blue), static_cast<double>(c.green), static_cast<double>(c.red)};
}

std::string ascii(const std::string& utf8) {
  std::string out;
  for (const char c : utf8) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0) == 0x80) continue;  // not the first byte of a letter
    out += byte < 0x20 || byte > 0x7E ? '?' : c;
  }
  return out;
}

// The pieces of a dashed line.
std::vector<std::vector<Vector2>> dashes(const std::vector<Vector2>& points, double length) {
  std::vector<std::vector<Vector2>> out{{points[0]}};
  double left = length;
  bool drawing = true;
  for (std::size_t k = 1; k < points.size(); ++k) {
    Vector2 at = points[k - 1];
    while ((points[k] - at).norm() > left) {
      at += (points[k] - at).normalized() * left;
      if (drawing) out.back().push_back(at);
      drawing = !drawing;
      if (drawing) out.push_back({at});
      left = length;
    }
    left -= (points[k] - at).norm();
    if (drawing) out.back().push_back(points[k]);
  }
  return out;
}

class PngDrawing : public Drawing {
 public:
  PngDrawing(double width, double height, Colour paper, double scale)
      : scale_(scale * kOversampling),
        size_(static_cast<int>(std::lround(width * scale)), static_cast<int>(std::lround(height * scale))),
        page_(size_ * kOversampling, CV_8UC3, scalar(paper)) {}

  void polyline(const std::vector<Vector2>& points, const Stroke& stroke) override {
    if (points.size() < 2) return;
    paint(points, stroke.width, stroke.colour, stroke.opacity, [&](cv::Mat& onto, const cv::Scalar& ink) {
      for (const auto& piece :
           stroke.dash > 0 ? dashes(points, stroke.dash) : std::vector<std::vector<Vector2>>{points})
        cv::polylines(onto, std::vector<std::vector<cv::Point>>{fixed(piece)}, false, ink, thickness(stroke.width),
                      cv::LINE_AA, kSubpixelBits);
    });
  }

  void polygon(const std::vector<Vector2>& points, Colour fill, double opacity) override {
    paint(points, 0, fill, opacity, [&](cv::Mat& onto, const cv::Scalar& ink) {
      cv::fillPoly(onto, std::vector<std::vector<cv::Point>>{fixed(points)}, ink, cv::LINE_AA, kSubpixelBits);
    });
  }

  void disc(const Vector2& middle, double radius, Colour fill, double rim, Colour rim_colour) override {
    const auto circle = [&](double r, Colour colour) {
      cv::circle(page_, fixed(middle), static_cast<int>(std::lround(r * scale_ * (1 << kSubpixelBits))), scalar(colour),
                 cv::FILLED, cv::LINE_AA, kSubpixelBits);
    };
    if (rim > 0) circle(radius + rim / 2, rim_colour);
    circle(rim > 0 ? radius - rim / 2 : radius, fill);
  }

  void text(const Vector2& at, const std::string& utf8, const TextStyle& style) override {
    const std::string letters = ascii(utf8);
    const double share = style.anchor == Anchor::kLeft ? 0 : style.anchor == Anchor::kMiddle ? 0.5 : 1;
    const Vector2 begin = (at - Vector2(share * text_width(utf8, style), 0)) * scale_;
    const cv::Point origin(static_cast<int>(std::lround(begin.x())), static_cast<int>(std::lround(begin.y())));
    const auto put = [&](Colour colour, int width) {
      cv::putText(page_, letters, origin, cv::FONT_HERSHEY_SIMPLEX, font_scale(style), scalar(colour), width,
                  cv::LINE_AA);
    };
    if (style.halo > 0) put({255, 255, 255}, stroke_of(style) + thickness(2 * style.halo));
    put(style.colour, stroke_of(style));
  }

  double text_width(const std::string& utf8, const TextStyle& style) const override {
    int baseline = 0;
    return cv::getTextSize(ascii(utf8), cv::FONT_HERSHEY_SIMPLEX, font_scale(style), stroke_of(style), &baseline)
               .width /
           scale_;
  }

  Status picture(const Vector2& corner, const Vector2& size, const std::string& file) override {
    auto decoded = decode_picture(file);
    if (!decoded.ok()) return decoded.status();
    const cv::Mat whole(decoded->height, decoded->width, CV_8UC3, decoded->bgr.data());
    const auto pixel = [this](double at) { return static_cast<int>(std::lround(at * scale_)); };
    const cv::Rect box(cv::Point(pixel(corner.x()), pixel(corner.y())),
                       cv::Point(pixel(corner.x() + size.x()), pixel(corner.y() + size.y())));
    const cv::Rect seen = box & cv::Rect(0, 0, page_.cols, page_.rows);
    if (seen.empty()) return {};
    cv::Mat scaled;
    cv::resize(whole, scaled, box.size(), 0, 0, box.width < whole.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
    scaled(seen - box.tl()).copyTo(page_(seen));
    return {};
  }

  Result<std::string> file() const override {
    cv::Mat picture;
    cv::resize(page_, picture, size_, 0, 0, cv::INTER_AREA);
    std::vector<std::uint8_t> bytes;
    try {
      if (cv::imencode(".png", picture, bytes, {cv::IMWRITE_PNG_COMPRESSION, 9}))
        return std::string(bytes.begin(), bytes.end());
    } catch (const cv::Exception& error) {
      return {Reason::INTERNAL, "the picture cannot be encoded: " + error.err};
    }
    return {Reason::INTERNAL, "the picture cannot be encoded"};
  }

 private:
  // Draws on the page. A transparent shape is drawn on a mask first, which is then blended with the page.
  template <typename Draw>
  void paint(const std::vector<Vector2>& points, double width, Colour colour, double opacity, const Draw& draw) {
    if (opacity >= 1) {
      draw(page_, scalar(colour));
      return;
    }
    cv::Rect box = cv::boundingRect(pixels(points));
    const int margin = thickness(width) + 4;
    box = cv::Rect(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin) &
          cv::Rect(0, 0, page_.cols, page_.rows);
    if (box.empty()) return;
    // The mask is kept for the next transparent shape, and is zero between shapes.
    if (mask_.empty()) mask_ = cv::Mat::zeros(page_.size(), CV_8U);
    draw(mask_, cv::Scalar(255));
    const double ink[3] = {static_cast<double>(colour.blue), static_cast<double>(colour.green),
                           static_cast<double>(colour.red)};
    for (int y = box.y; y < box.y + box.height; ++y)
      for (int x = box.x; x < box.x + box.width; ++x) {
        const double share = opacity * mask_.at<std::uint8_t>(y, x) / 255;
        auto& pixel = page_.at<cv::Vec3b>(y, x);
        for (int c = 0; c < 3; ++c) pixel[c] = cv::saturate_cast<std::uint8_t>(pixel[c] + share * (ink[c] - pixel[c]));
      }
    mask_(box).setTo(0);
  }

  cv::Point fixed(const Vector2& p) const {
    const double unit = scale_ * (1 << kSubpixelBits);
    return {static_cast<int>(std::lround(p.x() * unit)), static_cast<int>(std::lround(p.y() * unit))};
  }
  std::vector<cv::Point> fixed(const std::vector<Vector2>& points) const {
    std::vector<cv::Point> out;
    for (const Vector2& p : points) out.push_back(fixed(p));
    return out;
  }
  std::vector<cv::Point> pixels(const std::vector<Vector2>& points) const {
    std::vector<cv::Point> out;
    for (const Vector2& p : points)
      out.emplace_back(static_cast<int>(p.x() * scale_), static_cast<int>(p.y() * scale_));
    return out;
  }
  int thickness(double width) const { return std::max(1, static_cast<int>(std::lround(width * scale_))); }
  double font_scale(const TextStyle& style) const { return style.size * scale_ * kCapHeight / kCapUnits; }
  int stroke_of(const TextStyle& style) const { return thickness(style.size * (style.bold ? 0.135 : 0.085)); }

  double scale_;  // pixels of page_ per point
  cv::Size size_;
  cv::Mat page_;
  cv::Mat mask_;  // of the transparent shape that is being drawn
};

}  // namespace

std::unique_ptr<Drawing> make_png_drawing(double width, double height, Colour paper, double scale) {
  return std::make_unique<PngDrawing>(width, height, paper, scale);
}

}  // namespace relmap::client
