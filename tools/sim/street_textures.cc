// Posters, crates, trees, the sky and the ground.
#include "tools/sim/street_textures.h"

#include <algorithm>
#include <cmath>

#include "tools/sim/painting.h"

namespace relmap::sim {

Canvas paint_poster(double width, double height, Random& random) {
  Canvas canvas(width, height, kPropTexels, 120);
  paint_composition(canvas, 0, 0, width, height, random);
  const double band = height * random.uniform(0.15, 0.28), value = random.uniform(20, 235);
  const double y = random.chance(0.5) ? 0 : height - band;
  canvas.fill_rect(0, y, width, y + band, value);
  paint_letters(canvas, 0.06, y + band * 0.15, width - 0.12, band * 0.7, contrasting(value, random), random);
  canvas.frame_rect(0, 0, width, height, 0.035, random.chance(0.5) ? 235 : 25);
  canvas.roughen(0.04, 0.08, random);
  return canvas;
}

Canvas paint_poster_row(double width, double height, Random& random) {
  Canvas canvas(width, height, kPropTexels, random.uniform(60, 180));
  for (double x = 0; x < width - 0.2;) {
    const double w = std::min(random.uniform(0.4, 0.9), width - x);
    for (double y = 0.1; y < height - 0.2;) {
      const double h = std::min(random.uniform(0.4, 1.1), height - 0.1 - y);
      paint_composition(canvas, x, y, w - 0.03, h - 0.03, random);
      y += h;
    }
    x += w;
  }
  canvas.roughen(0.05, 0.08, random);
  return canvas;
}

Canvas paint_crates(double width, double height, Random& random) {
  Canvas canvas(width, height, kPropTexels, 40);
  const double value = random.uniform(70, 200), plank = random.uniform(0.08, 0.16);
  for (double y = 0; y < height; y += plank) {
    canvas.fill_rect(0, y, width, y + plank - 0.015, value * random.uniform(0.75, 1.2));
    for (double x = random.uniform(0.05, 0.3); x < width; x += random.uniform(0.2, 0.5))
      canvas.fill_ellipse(x, y + plank * 0.5, 0.014, 0.014, 30);
  }
  for (double x = 0; x < width; x += random.uniform(0.5, 0.8))
    canvas.fill_rect(x, 0, x + 0.09, height, value * random.uniform(0.6, 1.3));
  canvas.frame_rect(0, 0, width, height, 0.06, contrasting(value, random));
  for (double x = 0.12; x < width - 0.5; x += random.uniform(0.5, 0.9))
    if (random.chance(0.6))
      paint_letters(canvas, x, height * random.uniform(0.25, 0.6), 0.45, random.uniform(0.1, 0.2),
                    random.uniform(10, 50), random);
    else
      paint_composition(canvas, x, height * random.uniform(0.2, 0.5), 0.35, height * 0.35, random);
  canvas.roughen(0.2, 0.1, random);
  canvas.roughen(0.03, 0.12, random);
  return canvas;
}

Canvas paint_bark(double width, double height, Random& random) {
  Canvas canvas(width, height, kPropTexels, random.uniform(50, 120));
  for (int k = static_cast<int>(width * height * 150); k > 0; --k) {
    const double x = width * random.uniform(), y = height * random.uniform();
    canvas.line({x, y}, {x + random.uniform(-0.03, 0.03), y + random.uniform(0.04, 0.25)}, random.uniform(0.01, 0.03),
                random.uniform(15, 170));
  }
  canvas.roughen(0.05, 0.15, random);
  return canvas;
}

Canvas paint_foliage(double width, double height, Random& random) {
  Canvas canvas(width, height, 80, 40);
  const double base = random.uniform(60, 110);
  for (int k = static_cast<int>(width * height * 140); k > 0; --k) {
    const double x = width * random.uniform(), y = height * random.uniform(), r = random.uniform(0.03, 0.10);
    const double slant = random.uniform(0, M_PI);
    const Vector2 tip(r * std::cos(slant), r * std::sin(slant)), side(-0.35 * tip.y(), 0.35 * tip.x()), at(x, y);
    canvas.fill_polygon({at + tip, at + side, at - tip, at - side}, base * random.uniform(0.2, 2.0));
  }
  canvas.roughen(0.4, 0.25, random);
  return canvas;
}

Canvas paint_clouds(double width, double height, Random& random) {
  Canvas canvas(width, height, 2, 205);
  for (const double grain : {40.0, 18.0, 8.0, 3.0}) canvas.roughen(grain, 0.09, random);
  return canvas;
}

namespace {

void paint_asphalt(Canvas& canvas, Random& random) {
  canvas.roughen(2.5, 0.18, random);
  canvas.roughen(0.35, 0.14, random);
  canvas.roughen(0.12, 0.16, random);
  canvas.roughen(0.05, 0.22, random);
  canvas.roughen(0.02, 0.20, random);
}

// A rectangle in road coordinates (s along, d to the right), bent with the road.
void paint_on_road(Canvas& canvas, const Circuit& circuit, const Vector2& corner, double s0, double s1, double d0,
                   double d1, double value) {
  const int pieces = std::max(1, static_cast<int>(std::ceil((s1 - s0) / 0.6)));
  for (int k = 0; k < pieces; ++k) {
    const double a = s0 + (s1 - s0) * k / pieces, b = s0 + (s1 - s0) * (k + 1) / pieces;
    canvas.fill_polygon({circuit.beside(a, d0) - corner, circuit.beside(b, d0) - corner, circuit.beside(b, d1) - corner,
                         circuit.beside(a, d1) - corner},
                        value);
  }
}

void paint_pavement(Canvas& canvas, const Circuit& circuit, const Vector2& corner, double kerb, double outer,
                    Random& random) {
  const double side = kerb > 0 ? 1 : -1, width = std::abs(outer);
  double tile = 0.5, value = 130;
  for (double s = 0; s < circuit.length();) {
    if (random.chance(0.06)) {  // another stretch, paved otherwise
      tile = random.uniform(0.3, 0.8);
      value = random.uniform(80, 175);
    }
    const double next = std::min(s + tile, circuit.length());
    paint_on_road(canvas, circuit, corner, s, next, side * std::abs(kerb), side * (std::abs(kerb) + 0.16), 200);
    for (double d = std::abs(kerb) + 0.19; d < width; d += tile)
      paint_on_road(canvas, circuit, corner, s, next - 0.025, side * d, side * (d + tile - 0.025),
                    std::min(240.0, value * random.uniform(0.68, 1.32)));
    s = next;
  }
}

void paint_litter(Canvas& canvas, const Circuit& circuit, const Vector2& corner, double reach, Random& random) {
  for (int k = static_cast<int>(circuit.length() * reach * 2 * 16); k > 0; --k) {
    const Vector2 at = circuit.beside(circuit.length() * random.uniform(), reach * random.uniform(-1, 1)) - corner;
    const double r = 0.012 + 0.075 * random.uniform() * random.uniform(), turn = random.uniform(0, M_PI);
    const Vector2 a(r * std::cos(turn), r * std::sin(turn)), b(-0.6 * a.y(), 0.6 * a.x());
    canvas.fill_polygon({at + a, at + b, at - a, at - b},
                        random.chance(0.5) ? random.uniform(10, 55) : random.uniform(170, 240));
  }
}

void paint_cracks(Canvas& canvas, const Circuit& circuit, const Vector2& corner, double kerb, Random& random) {
  for (int k = static_cast<int>(circuit.length() * 1.5); k > 0; --k) {
    Vector2 at = circuit.beside(circuit.length() * random.uniform(), kerb * random.uniform(-1, 1)) - corner;
    double heading = random.uniform(0, 2 * M_PI);
    const double tar = random.uniform(20, 60), width = random.uniform(0.015, 0.045);
    for (int step = 5 + random.below(8); step > 0; --step) {
      heading += random.uniform(-0.9, 0.9);
      const Vector2 next = at + random.uniform(0.08, 0.25) * Vector2(std::cos(heading), std::sin(heading));
      canvas.line(at, next, width, tar);
      at = next;
    }
  }
}

}  // namespace

Canvas paint_ground(const Circuit& circuit, const Vector2& corner, double width, double height, Random& random) {
  Canvas canvas(width, height, kGroundTexels, 105);
  const double kerb = std::min(1.9, 0.5 * circuit.min_radius()), reach = std::min(6.5, circuit.length() / 8);
  const double inner = std::min(reach, 0.8 * circuit.min_radius());
  paint_pavement(canvas, circuit, corner, kerb * circuit.inner_side(), inner, random);
  paint_pavement(canvas, circuit, corner, -kerb * circuit.inner_side(), reach, random);
  const auto road = [&](double s0, double s1, double d0, double d1, double value) {
    paint_on_road(canvas, circuit, corner, s0, s1, d0, d1, value);
  };
  for (double s = 0; s < circuit.length();) {  // what is on the roadway changes along it
    const double stretch = random.uniform(2.0, 5.0);
    switch (random.below(6)) {
      case 0:  // zebra crossing
        for (double d = -kerb + 0.1; d < kerb - 0.3; d += 0.6) road(s, s + 2, d, d + 0.3, 225);
        break;
      case 1:  // mended asphalt
        road(s, s + stretch * 0.7, kerb * random.uniform(-0.8, 0), kerb * random.uniform(0.1, 0.9),
             random.uniform(45, 80));
        break;
      case 2: {  // manhole
        const Vector2 at = circuit.beside(s + 0.5, kerb * random.uniform(-0.5, 0.5)) - corner;
        for (int ring = 0; ring < 5; ++ring)
          canvas.fill_ellipse(at.x(), at.y(), 0.38 - 0.07 * ring, 0.38 - 0.07 * ring, ring % 2 == 0 ? 40 : 150);
        break;
      }
      case 3: {  // a painted square
        const Vector2 at = circuit.beside(s + 0.8, 0) - corner;
        paint_composition(canvas, at.x() - 0.6, at.y() - 0.6, 1.2, 1.2, random);
        break;
      }
      case 4:  // cobbles
        for (double c = s; c < s + stretch; c += 0.2)
          for (double d = -kerb; d < kerb - 0.05; d += 0.2) road(c, c + 0.17, d, d + 0.17, random.uniform(70, 165));
        break;
      default:
        break;
    }
    road(s, s + std::min(1.2, stretch), -0.06, 0.06, 215);
    s += stretch;
  }
  paint_cracks(canvas, circuit, corner, kerb, random);
  paint_litter(canvas, circuit, corner, reach, random);
  paint_asphalt(canvas, random);
  return canvas;
}

}  // namespace relmap::sim
