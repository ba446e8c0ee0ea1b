#include "tools/sim/motorway_textures.h"

#include <cmath>

#include "tools/sim/motorway_scene.h"
#include "tools/sim/painting.h"

namespace relmap::sim {

Canvas paint_motorway(Random& random) {
  const double width = kRoadRight - kRoadLeft;
  Canvas canvas(width, kRoadPiece, kRoadTexels, 98);
  const auto stripe = [&](double d0, double d1, double y0, double y1, double value) {
    canvas.fill_rect(d0 - kRoadLeft, y0, d1 - kRoadLeft, y1, value);
  };
  for (int lane = -1; lane <= 1; ++lane)
    for (const double track : {-0.85, 0.85})  // where the wheels run
      stripe(lane * kLaneWidth + track - 0.3, lane * kLaneWidth + track + 0.3, 0, kRoadPiece, 95);
  const double edge = 1.5 * kLaneWidth;
  stripe(edge, kRoadRight, 0, kRoadPiece, 102);
  canvas.roughen(3, 0.02, random);
  canvas.roughen(0.1, 0.02, random);
  canvas.roughen(0.03, 0.03, random);
  const double paint = random.uniform(185, 205);
  for (const double d : {-edge, edge}) stripe(d - 0.13, d + 0.13, 0, kRoadPiece, paint);
  for (const double d : {-kLaneWidth / 2, kLaneWidth / 2}) stripe(d - 0.08, d + 0.08, 4, 8, paint);
  return canvas;
}

Canvas paint_verge(double width, Random& random) {
  Canvas canvas(width, kRoadPiece, kVergeTexels, 84);
  canvas.roughen(4, 0.05, random);
  canvas.roughen(0.6, 0.05, random);
  canvas.roughen(0.15, 0.06, random);
  return canvas;
}

Canvas paint_rail(double height, Random& random) {
  Canvas canvas(kRoadPiece, height, kRailTexels, 150);
  canvas.fill_rect(0, 0.3 * height, kRoadPiece, 0.42 * height, 172);  // the two waves of its profile
  canvas.fill_rect(0, 0.42 * height, kRoadPiece, 0.6 * height, 112);
  canvas.fill_rect(0, 0.85 * height, kRoadPiece, height, 118);
  canvas.fill_rect(5.98, 0, 6.02, height, 120);  // where two pieces overlap
  canvas.roughen(1.5, 0.04, random);
  return canvas;
}

Canvas paint_barrier(double height, Random& random) {
  Canvas canvas(kRoadPiece, height, kVergeTexels, 128);
  canvas.roughen(3, 0.03, random);
  canvas.roughen(0.2, 0.025, random);
  for (double x = 0; x < kRoadPiece; x += 4) canvas.fill_rect(x, 0, x + 0.16, height, 112);
  canvas.shade_rect(0, 0.8 * height, kRoadPiece, height, 1.0, 0.85);
  return canvas;
}

Canvas paint_tree_line(double width, double height, Random& random) {
  Canvas canvas(width, height, kTreeTexels, 66);
  canvas.roughen(5, 0.16, random);
  canvas.roughen(1.5, 0.18, random);
  canvas.roughen(0.4, 0.14, random);
  canvas.shade_rect(0, 0, width, height, 1.12, 0.7);
  return canvas;
}

Canvas paint_fields(double width, double height, Random& random) {
  Canvas canvas(width, height, kFieldTexels, 92);
  for (const double grain : {150.0, 40.0, 10.0}) canvas.roughen(grain, 0.05, random);
  return canvas;
}

Canvas paint_hills(double width, double height, double value, Random& random) {
  Canvas canvas(width, height, kHillTexels, value);
  for (const double grain : {60.0, 15.0, 4.0}) canvas.roughen(grain, 0.05, random);
  return canvas;
}

Canvas paint_pale_sky(double width, double height, Random& random) {
  Canvas canvas(width, height, kSkyTexels, 222);
  canvas.shade_rect(0, 0, width, height, 0.72, 1.02);
  for (const double grain : {400.0, 150.0, 60.0}) canvas.roughen(grain, 0.025, random);
  return canvas;
}

Canvas paint_concrete(double width, double height, Random& random) {
  Canvas canvas(width, height, kVergeTexels, 135);
  canvas.roughen(4, 0.06, random);
  canvas.roughen(0.3, 0.03, random);
  return canvas;
}

Canvas paint_road_sign(double width, double height, Random& random) {
  Canvas canvas(width, height, kSignTexels, random.uniform(55, 90));
  const double line = 0.16 * height;
  for (double y = 0.12 * height; y + line < 0.95 * height; y += 1.7 * line)
    paint_letters(canvas, 0.08 * width, y, width * random.uniform(0.5, 0.84), line, 220, random);
  canvas.frame_rect(0, 0, width, height, 0.05, 220);
  return canvas;
}

}  // namespace relmap::sim
