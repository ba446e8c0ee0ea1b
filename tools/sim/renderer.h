// A software renderer: perspective-correct, z-buffered, mip-mapped, four samples a pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/geometry/camera.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

inline constexpr int kSamplesPerSide = 2;  // a shaded pixel has 2 x 2 samples

// What each sample of a picture sees. Each pixel has factor x factor evenly spaced samples.
struct Visibility {
  int width = 0;  // samples: camera.width * factor
  int height = 0;
  std::vector<float> inverse_depth;   // 1/m along the optical axis; 0: nothing
  std::vector<std::int32_t> surface;  // index for snapshot.surface(); -1: nothing
};

// Finds what an eye at T_world_eye sees; its intrinsics are those of `camera`.
Visibility find_visible(const Snapshot& snapshot, const StereoCamera& camera, const SE3& T_world_eye, int factor);

// Brightness 0..255, before exposure and noise; row by row. `visible`: by find_visible() with kSamplesPerSide.
std::vector<float> shade(const Snapshot& snapshot, const StereoCamera& camera, const SE3& T_world_eye,
                         const Visibility& visible);

}  // namespace relmap::sim
