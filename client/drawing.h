// A page to draw shapes and text on, which can be written as SVG or PNG.
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
// Interpolates linearly between two colours; t in 0..1.
Colour mix(Colour from, Colour to, double t);

inline bool operator==(Colour a, Colour b) { return a.red == b.red && a.green == b.green && a.blue == b.blue; }

struct Stroke {
  Colour colour;
  double width = 1;
  double opacity = 1;  // 0..1, uniform even where the line crosses itself
  double dash = 0;     // length of the dashes and of the gaps between them; 0: solid
};

enum class Anchor : std::uint8_t { kLeft, kMiddle, kRight };

struct TextStyle {
  double size = 16;  // of the em
  Colour colour;
  bool bold = false;
  Anchor anchor = Anchor::kLeft;
  double halo = 0;  // width of a white rim around the letters
};

// Lengths and positions are in points, x to the right and y down from the top left corner of the page. Shapes drawn
// later lie above earlier ones. Not thread-safe.
class Drawing {
 public:
  virtual ~Drawing() = default;

  virtual void polyline(const std::vector<Vector2>& points, const Stroke& stroke) = 0;
  virtual void polygon(const std::vector<Vector2>& points, Colour fill, double opacity) = 0;
  // A filled disc with a rim of width `rim`; 0: no rim.
  virtual void disc(const Vector2& middle, double radius, Colour fill, double rim, Colour rim_colour) = 0;
  // `at`: the left end, middle, or right end of the baseline, as style.anchor says.
  virtual void text(const Vector2& at, const std::string& utf8, const TextStyle& style) = 0;
  virtual double text_width(const std::string& utf8, const TextStyle& style) const = 0;
  // Draws a JPEG or PNG, scaled to `size`, as it is stored: without the turn that a camera may have noted in it.
  // NOT_A_PICTURE: it is neither. PICTURE_DAMAGED: it cannot be read. Nothing is drawn then.
  virtual Status picture(const Vector2& corner, const Vector2& size, const std::string& file) = 0;
  // The page as the bytes of a file. INTERNAL: it cannot be encoded.
  virtual Result<std::string> file() const = 0;

  // Writes the page to `path`. IO_ERROR; the reason of file().
  Status save(const std::string& path) const;
  void line(const Vector2& from, const Vector2& to, const Stroke& stroke) { polyline({from, to}, stroke); }
  void rectangle(const Vector2& corner, const Vector2& size, Colour fill, double opacity);
};

// Writes a file. IO_ERROR.
Status write_file(const std::string& path, const std::string& bytes);

// Width and height of a JPEG or PNG, pixels. NOT_A_PICTURE, PICTURE_DAMAGED.
Result<Vector2> picture_size(const std::string& file);

enum class PictureFormat : std::uint8_t { kSvg, kPng };
// By the ending of a file's name. INVALID_ARGUMENT: it is neither .svg nor .png.
Result<PictureFormat> picture_format(const std::string& path);
// Of the format; `scale` is for PNG.
std::unique_ptr<Drawing> make_drawing(PictureFormat format, double width, double height, Colour paper, double scale);

// Draws scalable vector graphics. Control characters and those that turn the direction of writing are shown as U+FFFD.
// Pictures are part of the file. The fonts are those of the reader's machine.
std::unique_ptr<Drawing> make_svg_drawing(double width, double height, Colour paper);
// Draws portable network graphics with `scale` pixels per point. Letters are drawn as strokes, those beyond ASCII as
// '?'.
std::unique_ptr<Drawing> make_png_drawing(double width, double height, Colour paper, double scale);

}  // namespace relmap::client
