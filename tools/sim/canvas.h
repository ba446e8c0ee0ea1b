// A grey picture to paint textures on: shapes in metres, values 0 (black) .. 255.
#pragma once

#include <vector>

#include "proto/geometry/geometry.h"
#include "tools/sim/random.h"

namespace relmap::sim {

// x to the right and y down from the top left corner, in metres. What is painted outside is cut off.
class Canvas {
 public:
  Canvas(double width_m, double height_m, double texels_per_metre, double value);

  int width() const { return width_; }  // texels
  int height() const { return height_; }
  double texels_per_metre() const { return scale_; }
  double width_m() const { return width_ / scale_; }
  double height_m() const { return height_ / scale_; }
  float at(int x, int y) const { return pixels_[static_cast<std::size_t>(y) * width_ + x]; }

  void fill_rect(double x0, double y0, double x1, double y1, double value);
  void frame_rect(double x0, double y0, double x1, double y1, double thickness, double value);
  void fill_ellipse(double x, double y, double radius_x, double radius_y, double value);
  void fill_polygon(const std::vector<Vector2>& convex, double value);
  void line(const Vector2& from, const Vector2& to, double thickness, double value);
  // Brightness changing linearly from the rectangle's top to its bottom.
  void shade_rect(double x0, double y0, double x1, double y1, double top_factor, double bottom_factor);
  // Multiplies by smooth value noise, 1 +- amplitude, of the given grain, over the rectangle.
  void roughen(double x0, double y0, double x1, double y1, double grain_m, double amplitude, Random& random);
  void roughen(double grain_m, double amplitude, Random& random) {
    roughen(0, 0, width_m(), height_m(), grain_m, amplitude, random);
  }

 private:
  struct Span {
    int begin, end;
  };
  // The texels whose centres lie in [low, high) metres.
  Span span(double low, double high, int size) const;
  float& pixel(int x, int y) { return pixels_[static_cast<std::size_t>(y) * width_ + x]; }

  double scale_;
  int width_, height_;
  std::vector<float> pixels_;
};

}  // namespace relmap::sim
