// What the simulated streets are covered with, painted from random numbers: every world has its own facades, posters
// and pavements, made of the same kinds of things.
#pragma once

#include "tools/sim/canvas.h"
#include "tools/sim/circuit.h"
#include "tools/sim/random.h"

namespace relmap::sim {

inline constexpr double kWallTexels = 90;   // per metre
inline constexpr double kPropTexels = 150;  // seen from nearer
inline constexpr double kGroundTexels = 90;

// A house front of width x height metres, its foot at the canvas's bottom.
Canvas paint_facade(double width, double height, Random& random);
// A wall without windows: gables, pilasters, the sides of things.
Canvas paint_wall(double width, double height, double texels_per_metre, Random& random);
// Something to put on a board: letters, shapes, grids; no two alike.
Canvas paint_poster(double width, double height, Random& random);
// A row of posters round an advertising column.
Canvas paint_poster_row(double width, double height, Random& random);
Canvas paint_crates(double width, double height, Random& random);
Canvas paint_bark(double width, double height, Random& random);
Canvas paint_foliage(double width, double height, Random& random);
Canvas paint_clouds(double width, double height, Random& random);
// The road with its pavements; canvas coordinates are plan coordinates minus `corner`.
Canvas paint_ground(const Circuit& circuit, const Vector2& corner, double width, double height, Random& random);

}  // namespace relmap::sim
