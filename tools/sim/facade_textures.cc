// House fronts and walls.
#include <algorithm>
#include <cmath>

#include "tools/sim/painting.h"
#include "tools/sim/street_textures.h"

namespace relmap::sim {
namespace {

// The style that the windows of one house share.
struct WindowStyle {
  double frame, glass, thickness;
  int columns, rows;
  bool arched;

  explicit WindowStyle(Random& random)
      : frame(random.chance(0.7) ? random.uniform(170, 240) : random.uniform(20, 70)),
        glass(frame > 120 ? random.uniform(20, 75) : random.uniform(110, 190)),
        thickness(random.uniform(0.05, 0.09)),
        columns(1 + random.below(3)),
        rows(1 + random.below(3)),
        arched(random.chance(0.25)) {}
};

void paint_pane(Canvas& canvas, double x, double y, double w, double h, double glass, Random& random) {
  canvas.fill_rect(x, y, x + w, y + h, glass);
  canvas.shade_rect(x, y, x + w, y + h, random.uniform(0.7, 1.6), random.uniform(0.7, 1.6));
  switch (random.below(6)) {
    case 0: {  // a reflection
      const double a = x + w * random.uniform(), b = a + w * random.uniform(0.15, 0.4);
      canvas.fill_polygon({{std::min(a, x + w), y}, {std::min(b, x + w), y}, {x + w * 0.4, y + h}, {x, y + h}},
                          glass * random.uniform(1.4, 2.2) + 20);
      break;
    }
    case 1: {  // curtains
      const double cloth = random.uniform(120, 225), reach = w * random.uniform(0.25, 0.5);
      canvas.fill_polygon({{x, y}, {x + reach, y}, {x, y + h * random.uniform(0.7, 1)}}, cloth);
      canvas.fill_polygon({{x + w, y}, {x + w - reach, y}, {x + w, y + h * random.uniform(0.7, 1)}}, cloth * 0.9);
      break;
    }
    case 2: {  // a blind, partly down
      const double bottom = y + h * random.uniform(0.2, 0.9), slat = random.uniform(0.04, 0.08);
      for (double row = y; row < bottom; row += slat)
        canvas.fill_rect(x, row, x + w, std::min(row + slat * 0.6, bottom), random.uniform(130, 215));
      break;
    }
    case 3:  // a plant on the sill
      for (int k = 0; k < 9; ++k)
        canvas.fill_ellipse(x + w * random.uniform(0.1, 0.9), y + h * random.uniform(0.45, 0.95), w * 0.13, h * 0.08,
                            random.uniform(20, 190));
      break;
    case 4:  // a picture or a note on the glass
      paint_composition(canvas, x + w * 0.15, y + h * random.uniform(0.1, 0.4), w * random.uniform(0.4, 0.7),
                        h * random.uniform(0.3, 0.5), random);
      break;
    default:
      break;
  }
}

void paint_window(Canvas& canvas, double x, double y, double w, double h, const WindowStyle& style, Random& random) {
  const double rim = style.thickness;
  canvas.fill_rect(x - rim, y - rim, x + w + rim, y + h + rim, style.frame);
  if (style.arched) canvas.fill_ellipse(x + w / 2, y, w / 2 + rim, w * 0.3, style.frame);
  const double pw = (w - rim * (style.columns - 1) * 0.7) / style.columns;
  const double ph = (h - rim * (style.rows - 1) * 0.7) / style.rows;
  for (int r = 0; r < style.rows; ++r)
    for (int c = 0; c < style.columns; ++c)
      paint_pane(canvas, x + c * (pw + rim * 0.7), y + r * (ph + rim * 0.7), pw, ph, style.glass, random);
  canvas.fill_rect(x - 2 * rim, y + h + rim, x + w + 2 * rim, y + h + 2.4 * rim, std::min(245.0, style.frame * 1.1));
  canvas.fill_rect(x - 2 * rim, y + h + 2.4 * rim, x + w + 2 * rim, y + h + 3.6 * rim, 35);
}

void paint_door(Canvas& canvas, double x, double bottom, double w, double h, Random& random) {
  const double leaf = random.uniform(30, 200), panel = contrasting(leaf, random);
  canvas.fill_rect(x - 0.1, bottom - h - 0.1, x + w + 0.1, bottom, contrasting(leaf, random));
  canvas.fill_rect(x, bottom - h, x + w, bottom, leaf);
  const int rows = 2 + random.below(3);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < 2; ++c) {
      const double px = x + w * (0.1 + 0.45 * c), py = bottom - h * 0.95 + r * 0.9 * h / rows;
      canvas.frame_rect(px, py, px + w * 0.35, py + 0.75 * h / rows, 0.035, panel);
      if (random.chance(0.3)) canvas.fill_rect(px, py, px + w * 0.35, py + 0.75 * h / rows, panel);
    }
  canvas.fill_ellipse(x + w * 0.88, bottom - h * 0.48, 0.04, 0.04, 230);
  paint_letters(canvas, x + w * 0.2, bottom - h - 0.35, w * 0.6, 0.2, contrasting(leaf, random), random);
}

void paint_shop(Canvas& canvas, double x, double bottom, double w, double h, Random& random) {
  const double sign = random.uniform(25, 230), sign_height = random.uniform(0.4, 0.65);
  canvas.fill_rect(x, bottom - h - sign_height, x + w, bottom - h, sign);
  paint_letters(canvas, x + 0.1, bottom - h - sign_height * 0.85, w - 0.2, sign_height * 0.65,
                contrasting(sign, random), random);
  const double frame = random.uniform(30, 220), glass = random.uniform(20, 70);
  canvas.fill_rect(x, bottom - h, x + w, bottom, frame);
  const double top = bottom - h + 0.1, foot = bottom - random.uniform(0.3, 0.6);
  canvas.fill_rect(x + 0.1, top, x + w - 0.1, foot, glass);
  const int shelves = 2 + random.below(3);
  for (int s = 1; s <= shelves; ++s) {  // goods on shelves
    const double y = top + (foot - top) * s / shelves;
    canvas.fill_rect(x + 0.1, y - 0.04, x + w - 0.1, y, frame);
    for (double gx = x + 0.15; gx < x + w - 0.3;) {
      const double gw = random.uniform(0.08, 0.35), gh = (foot - top) / shelves * random.uniform(0.3, 0.85);
      const double value = random.uniform(25, 240);
      if (random.chance(0.3))
        canvas.fill_ellipse(gx + gw / 2, y - 0.04 - gh / 2, gw / 2, gh / 2, value);
      else
        canvas.fill_rect(gx, y - 0.04 - gh, gx + gw, y - 0.04, value);
      if (random.chance(0.5))
        paint_letters(canvas, gx, y - gh * 0.7, gw, gh * 0.25, contrasting(value, random), random);
      gx += gw + random.uniform(0.02, 0.2);
    }
  }
}

void paint_poster_group(Canvas& canvas, double x, double bottom, double w, Random& random) {
  for (double px = x; px < x + w - 0.4;) {
    const double pw = random.uniform(0.45, 0.95), ph = pw * random.uniform(0.9, 1.5);
    const double py = bottom - random.uniform(0.5, 0.9) - ph;
    if (px + pw > x + w) break;
    paint_composition(canvas, px, py, pw, ph, random);
    canvas.frame_rect(px, py, px + pw, py + ph, 0.03, random.chance(0.5) ? 235 : 25);
    px += pw + random.uniform(0.03, 0.3);
  }
}

void paint_graffiti(Canvas& canvas, double x, double bottom, double w, Random& random) {
  const double ink = random.chance(0.5) ? random.uniform(10, 50) : random.uniform(200, 245);
  for (int k = 0; k < 3; ++k) {
    Vector2 at(x + w * random.uniform(0.1, 0.9), bottom - random.uniform(0.5, 1.7));
    double heading = random.uniform(0, 2 * M_PI);
    for (int step = 0; step < 24; ++step) {
      heading += random.uniform(-0.8, 0.8);
      Vector2 next = at + 0.11 * Vector2(std::cos(heading), std::sin(heading));
      next.x() = std::clamp(next.x(), x, x + w);
      next.y() = std::clamp(next.y(), bottom - 2.0, bottom - 0.2);
      canvas.line(at, next, 0.06, ink);
      at = next;
    }
  }
  paint_letters(canvas, x, bottom - random.uniform(0.9, 1.6), w, random.uniform(0.25, 0.5), ink, random);
}

void paint_ivy(Canvas& canvas, double x, double bottom, double w, double h, Random& random) {
  for (int k = static_cast<int>(w * h * 160); k > 0; --k) {
    const double up = random.uniform() * random.uniform() * h;
    canvas.fill_ellipse(x + w * random.uniform(), bottom - up, random.uniform(0.02, 0.07), random.uniform(0.02, 0.06),
                        random.uniform(15, 130));
  }
}

// The part that a camera in the street sees best: all different, side by side.
void paint_ground_floor(Canvas& canvas, double bottom, double height, const WindowStyle& style, Random& random) {
  const double width = canvas.width_m();
  for (double x = random.uniform(0.1, 0.4); x < width - 0.6;) {
    const double left = width - x - 0.15;
    double used = 0;
    switch (random.below(7)) {
      case 0:
        used = std::min(left, random.uniform(0.9, 1.3));
        paint_door(canvas, x, bottom, used, random.uniform(1.9, 2.2), random);
        break;
      case 1:
      case 2:
        used = std::min(left, random.uniform(1.6, 3.0));
        paint_shop(canvas, x, bottom, used, std::min(2.1, height - 0.8), random);
        break;
      case 3:
        used = std::min(left, random.uniform(1.2, 2.8));
        paint_poster_group(canvas, x, bottom, used, random);
        break;
      case 4:
        used = std::min(left, random.uniform(1.0, 1.4));
        paint_window(canvas, x, bottom - 2.1, used, 1.25, style, random);
        break;
      case 5:
        used = std::min(left, random.uniform(1.2, 2.2));
        paint_graffiti(canvas, x, bottom, used, random);
        break;
      default:
        used = std::min(left, random.uniform(0.8, 2.0));
        paint_ivy(canvas, x, bottom, used, height, random);
    }
    x += used + random.uniform(0.15, 0.5);
  }
}

}  // namespace

Canvas paint_facade(double width, double height, Random& random) {
  Canvas canvas(width, height, kWallTexels, 120);
  paint_masonry(canvas, 0, 0, width, height, random);
  const double ground_floor = random.uniform(2.7, 3.2);
  if (random.chance(0.4)) paint_masonry(canvas, 0, height - ground_floor, width, ground_floor, random);
  const WindowStyle style(random);
  const double storey = random.uniform(2.3, 2.9);
  const int columns = std::max(1, static_cast<int>(width / random.uniform(1.5, 2.4)));
  const double pitch = width / columns, w = std::min(pitch * 0.6, random.uniform(0.8, 1.3));
  for (double floor = height - ground_floor; floor > 1.8; floor -= storey) {
    const double ledge = random.uniform(30, 230);
    canvas.fill_rect(0, floor - 0.08, width, floor, ledge);
    canvas.fill_rect(0, floor, width, floor + 0.06, 30);
    for (int c = 0; c < columns; ++c) {
      const double x = c * pitch + (pitch - w) / 2;
      if (random.chance(0.85))
        paint_window(canvas, x, floor - 1.95, w, 1.3, style, random);
      else
        paint_composition(canvas, x, floor - 1.9, w, 1.2, random);
    }
  }
  paint_ground_floor(canvas, height, ground_floor, style, random);
  canvas.roughen(0.25, 0.08, random);
  canvas.shade_rect(0, height - 0.35, width, height, 1, 0.6);
  return canvas;
}

Canvas paint_wall(double width, double height, double texels_per_metre, Random& random) {
  Canvas canvas(width, height, texels_per_metre, 120);
  paint_masonry(canvas, 0, 0, width, height, random);
  if (width > 0.8 && height > 1.5) paint_composition(canvas, 0.1, height - 1.9, width - 0.2, 1.2, random);
  return canvas;
}

}  // namespace relmap::sim
