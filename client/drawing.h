// A page to draw on: one set of shapes, written as vectors or as pixels.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap::client {

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;
};
// Linear between two colours; t in 0..1.
Colour mix(Colour from, Colour to, double t);

struct Stroke {
  Colour colour;
  double width = 1;
  double opacity = 1;  // 0..1; of the whole line, also where it crosses itself
  double dash = 0;     // length of dashes and of the gaps between them; 0: solid
};

enum class Anchor : std::uint8_t { kLeft, kMiddle, kRight };

struct TextStyle {
  double size = 16;  // of the letters' em
  Colour colour;
  bool bold = false;
  Anchor anchor = Anchor::kLeft;
  double halo = 0;  // width of a white rim round the letters
};

// Lengths and places are in points of the page: x to the right, y down from its top left corner. What is drawn later
// lies above. Not thread-safe.
class Drawing {
 public:
  virtual ~Drawing() = default;

  virtual void polyline(const std::vector<Vector2>& points, const Stroke& stroke) = 0;
  virtual void polygon(const std::vector<Vector2>& points, Colour fill, double opacity) = 0;
  // A filled disc with a rim; rim 0: none.
  virtual void disc(const Vector2& middle, double radius, Colour fill, double rim, Colour rim_colour) = 0;
  // `at`: where the baseline begins, has its middle, or ends.
  virtual void text(const Vector2& at, const std::string& utf8, const TextStyle& style) = 0;
  virtual double text_width(const std::string& utf8, const TextStyle& style) const = 0;
  // IO_ERROR
  virtual Status save(const std::string& path) const = 0;

  void line(const Vector2& from, const Vector2& to, const Stroke& stroke) { polyline({from, to}, stroke); }
  void rectangle(const Vector2& corner, const Vector2& size, Colour fill, double opacity);
};

// Scalable vector graphics; fonts are the reader's.
std::unique_ptr<Drawing> make_svg_drawing(double width, double height, Colour paper);
// Portable network graphics, `scale` pixels to a point; letters are drawn as strokes, those beyond ASCII as '?'.
std::unique_ptr<Drawing> make_png_drawing(double width, double height, Colour paper, double scale);

}  // namespace relmap::client
