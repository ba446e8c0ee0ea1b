#include "tools/sim/painting.h"

#include <algorithm>
#include <cmath>

namespace relmap::sim {

double contrasting(double value, Random& random) {
  return value > 120 ? random.uniform(15, value - 70) : random.uniform(value + 80, 240);
}

void paint_letters(Canvas& canvas, double x, double y, double width, double height, double ink, Random& random) {
  const double pitch = height * random.uniform(0.62, 0.85);
  const double stroke = height * random.uniform(0.12, 0.22);
  const int letters = static_cast<int>(width / pitch);
  for (int k = 0; k < letters; ++k) {
    if (random.chance(0.12)) continue;  // a space
    const double left = x + k * pitch, right = left + pitch * 0.74;
    const double middle = (left + right) / 2;
    // Nodes of a 3 x 3 grid, joined by two to four strokes, as in most alphabets.
    const double columns[3] = {left, middle, right}, rows[3] = {y, y + height / 2, y + height};
    const int strokes = 2 + random.below(3);
    int cx = random.below(3), cy = random.below(3);
    for (int s = 0; s < strokes; ++s) {
      int nx = random.below(3), ny = random.below(3);
      if (nx == cx && ny == cy) ny = (ny + 1) % 3;
      canvas.line({columns[cx], rows[cy]}, {columns[nx], rows[ny]}, stroke, ink);
      if (random.chance(0.6)) {
        cx = nx;
        cy = ny;
      }
    }
    if (random.chance(0.25)) canvas.frame_rect(left, y, right, y + height * random.uniform(0.5, 1), stroke, ink);
  }
}

void paint_composition(Canvas& canvas, double x, double y, double width, double height, Random& random) {
  const double paper = random.uniform(20, 235);
  canvas.fill_rect(x, y, x + width, y + height, paper);
  const double ink = contrasting(paper, random);
  const auto px = [&] { return x + width * random.uniform(); };
  const auto py = [&] { return y + height * random.uniform(); };
  switch (random.below(6)) {
    case 0: {  // a matrix of cells
      const int columns = 5 + random.below(7);
      const double cell = width / columns;
      const int rows = std::max(3, static_cast<int>(height / cell));
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c)
          if (random.chance(0.5))
            canvas.fill_rect(x + c * cell, y + r * height / rows, x + (c + 1) * cell, y + (r + 1) * height / rows,
                             random.chance(0.85) ? ink : random.uniform(20, 235));
      break;
    }
    case 1:  // triangles
      for (int k = 0; k < 9; ++k)
        canvas.fill_polygon({{px(), py()}, {px(), py()}, {px(), py()}}, random.uniform(15, 240));
      break;
    case 2: {  // discs
      for (int k = 0; k < 8; ++k) {
        const double cx = px(), cy = py(), r = width * random.uniform(0.06, 0.3);
        for (int ring = 0; ring < 3; ++ring)
          canvas.fill_ellipse(cx, cy, r * (1 - 0.3 * ring), r * (1 - 0.3 * ring), random.uniform(15, 240));
      }
      break;
    }
    case 3: {  // rays
      const Vector2 eye(px(), py());
      const int rays = 7 + random.below(8);
      for (int k = 0; k < rays; ++k) {
        const double a = 2 * M_PI * k / rays, b = a + M_PI / rays, reach = width + height;
        canvas.fill_polygon(
            {eye, eye + reach * Vector2(std::cos(a), std::sin(a)), eye + reach * Vector2(std::cos(b), std::sin(b))},
            k % 3 == 0 ? random.uniform(15, 240) : ink);
      }
      break;
    }
    case 4:  // a page of text
      for (double row = y + 0.05 * height, size; row < y + 0.9 * height; row += size * 1.5) {
        size = height * random.uniform(0.05, 0.17);
        paint_letters(canvas, x + 0.06 * width, row, 0.88 * width, std::min(size, y + 0.97 * height - row), ink,
                      random);
      }
      break;
    default:  // rectangles over one another
      for (int k = 0; k < 14; ++k) {
        const double cx = px(), cy = py();
        canvas.fill_rect(cx, cy, cx + width * random.uniform(0.05, 0.4), cy + height * random.uniform(0.05, 0.35),
                         random.uniform(15, 240));
      }
  }
}

namespace {

struct Courses {
  double height, min_length, max_length, joint, joint_value, spread;
};

void paint_courses(Canvas& canvas, double x, double y, double width, double height, double value, const Courses& c,
                   Random& random) {
  canvas.fill_rect(x, y, x + width, y + height, c.joint_value);
  for (double top = y; top < y + height; top += c.height)
    for (double left = x - random.uniform(0, c.max_length); left < x + width;) {
      const double right = left + random.uniform(c.min_length, c.max_length);
      const double brick = std::clamp(value * random.uniform(1 - c.spread, 1 + c.spread), 10.0, 245.0);
      canvas.fill_rect(std::max(left, x), top, std::min(right - c.joint, x + width),
                       std::min(top + c.height - c.joint, y + height), brick);
      left = right;
    }
}

}  // namespace

void paint_masonry(Canvas& canvas, double x, double y, double width, double height, Random& random) {
  const double value = random.uniform(65, 185);
  const double joint = std::clamp(value + random.sign() * random.uniform(25, 55), 20.0, 230.0);
  switch (random.below(5)) {
    case 0:
      paint_courses(canvas, x, y, width, height, value, {0.085, 0.2, 0.26, 0.014, joint, 0.28}, random);
      break;
    case 1: {
      const double course = random.uniform(0.2, 0.45);
      paint_courses(canvas, x, y, width, height, value, {course, course, 2.2 * course, 0.022, joint, 0.26}, random);
      break;
    }
    case 2: {
      const double tile = random.uniform(0.3, 0.7);
      paint_courses(canvas, x, y, width, height, value, {tile, tile, tile * 1.02, 0.03, joint, 0.35}, random);
      break;
    }
    case 3: {
      const double plank = random.uniform(0.1, 0.2);
      paint_courses(canvas, x, y, width, height, value, {plank, 1.2, 2.6, 0.016, joint, 0.22}, random);
      break;
    }
    default: {
      canvas.fill_rect(x, y, x + width, y + height, value);
      canvas.roughen(x, y, x + width, y + height, 0.5, 0.25, random);
      for (int k = static_cast<int>(width * height * 0.5); k > 0; --k) {  // plaster that has come off
        const double cx = x + width * random.uniform(), cy = y + height * random.uniform();
        const double r = random.uniform(0.05, 0.35), patch = contrasting(value, random);
        for (int blob = 0; blob < 5; ++blob)
          canvas.fill_ellipse(cx + r * random.uniform(-1, 1), cy + r * random.uniform(-1, 1),
                              r * random.uniform(0.2, 0.7), r * random.uniform(0.2, 0.6),
                              patch * random.uniform(0.9, 1.1));
      }
      for (int k = static_cast<int>(width * 0.8); k > 0; --k) {  // cracks
        Vector2 at(x + width * random.uniform(), y + height * random.uniform());
        for (int step = 0; step < 12; ++step) {
          const Vector2 next = at + Vector2(random.uniform(-0.12, 0.12), random.uniform(0.02, 0.15));
          canvas.line(at, next, 0.016, value * 0.4);
          at = next;
        }
      }
    }
  }
  canvas.roughen(x, y, x + width, y + height, 0.9, 0.14, random);
  canvas.roughen(x, y, x + width, y + height, 0.12, 0.10, random);
  canvas.roughen(x, y, x + width, y + height, 0.03, 0.10, random);
}

}  // namespace relmap::sim
