// The motifs that several textures share.
#pragma once

#include "tools/sim/canvas.h"
#include "tools/sim/random.h"

namespace relmap::sim {

// A line of made-up letters that fills the rectangle.
void paint_letters(Canvas& canvas, double x, double y, double width, double height, double ink, Random& random);
// One of several abstract compositions: rays, triangles, discs, a grid of cells, lines of letters.
void paint_composition(Canvas& canvas, double x, double y, double width, double height, Random& random);
// Bricks, stone blocks, panels, planks or bare plaster, over the whole rectangle.
void paint_masonry(Canvas& canvas, double x, double y, double width, double height, Random& random);
// A value far from `value`.
double contrasting(double value, Random& random);

}  // namespace relmap::sim
