// A pair as the tracker saw it, drawn for people.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "frontend/tracking/pipeline.h"

namespace relmap::frontend {

// Row by row; blue, green, red.
struct ColourPicture {
  int width = 0, height = 0;  // even: video asks for it
  std::vector<std::uint8_t> bgr;
};

// The left picture, small ones enlarged; on it
// - which pair it is: its index in the source, the left picture's file name, its time in seconds;
// - the landmarks found: discs those that agree with the motion, from blue (young) to red (16 keyframes and more),
// small
//   crosses those that do not;
// - where the camera turned since the pair before: an arrow that reaches the ring at 5 degrees, and a horizon that
// tilts
//   ten times as much as the camera;
// below it the pair's figures, and what is special about it. A frame round it says: a keyframe, or lost.
ColourPicture draw_tracks(const tracking::TrackedPair& pair);

}  // namespace relmap::frontend
