// Draws a pair with its tracks, for people to look at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "frontend/tracking/pipeline.h"

namespace relmap::frontend {

// Pixels row by row, in the order blue, green, red.
struct ColourPicture {
  int width = 0, height = 0;  // even, as video requires
  std::vector<std::uint8_t> bgr;
};

// Draws the left picture (small ones are enlarged) with
// - the pair's index in the source, the left picture's file name, and its time in seconds;
// - the landmarks that were found: discs for those that agree with the motion, from blue (young) to red (16
//   keyframes and more), and small crosses for those that do not;
// - the rotation since the pair before: an arrow that reaches the ring at 5 degrees, and a horizon that tilts ten
//   times as much as the camera.
// Below it are the pair's figures. A coloured frame marks a keyframe or a lost pair.
ColourPicture draw_tracks(const tracking::TrackedPair& pair);

}  // namespace relmap::frontend
