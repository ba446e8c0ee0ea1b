// What the simulated motorway is covered with: plain surfaces of faint grain.
#pragma once

#include "tools/sim/canvas.h"
#include "tools/sim/random.h"

namespace relmap::sim {

inline constexpr double kRoadTexels = 50;  // per metre
inline constexpr double kVergeTexels = 25;
inline constexpr double kRailTexels = 60;
inline constexpr double kTreeTexels = 10;
inline constexpr double kFieldTexels = 0.25;
inline constexpr double kHillTexels = 1;
inline constexpr double kSkyTexels = 0.2;
inline constexpr double kSignTexels = 80;

inline constexpr double kRoadPiece = 12;   // metres along the road: a dash of 4 m and a gap of 8 m
inline constexpr double kRoadLeft = -6.4;  // of the middle lane's middle, metres
inline constexpr double kRoadRight = 8.1;  // with the hard shoulder

// x from kRoadLeft to kRoadRight, y along the road.
Canvas paint_motorway(Random& random);
Canvas paint_verge(double width, Random& random);     // y along the road
Canvas paint_rail(double height, Random& random);     // x along the road
Canvas paint_barrier(double height, Random& random);  // x along the road
Canvas paint_tree_line(double width, double height, Random& random);
Canvas paint_fields(double width, double height, Random& random);
Canvas paint_hills(double width, double height, double value, Random& random);
Canvas paint_pale_sky(double width, double height, Random& random);
Canvas paint_concrete(double width, double height, Random& random);
Canvas paint_road_sign(double width, double height, Random& random);

}  // namespace relmap::sim
