// A picture in 8 x 6 cells, by which it is told what two views of a place show differently.
#pragma once

#include <algorithm>
#include <cstddef>

#include "proto/geometry/camera.h"

namespace relmap::place {

inline constexpr int kPictureColumns = 8, kPictureRows = 6;
inline constexpr std::size_t kPictureCells = kPictureColumns * kPictureRows;

// Of a pixel of the left picture; one beyond its edge counts for the cell at the edge.
inline std::size_t picture_cell(const StereoCamera& camera, double u, double v) {
  const int column = std::clamp(static_cast<int>((u + 0.5) / camera.width * kPictureColumns), 0, kPictureColumns - 1);
  const int row = std::clamp(static_cast<int>((v + 0.5) / camera.height * kPictureRows), 0, kPictureRows - 1);
  return static_cast<std::size_t>(row * kPictureColumns + column);
}

}  // namespace relmap::place
