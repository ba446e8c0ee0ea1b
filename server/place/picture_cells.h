// Divides a picture into 8 x 6 cells, by which views of a place are compared.
#pragma once

#include <algorithm>
#include <cstddef>

#include "proto/geometry/camera.h"

namespace relmap::place {

inline constexpr int kPictureColumns = 8, kPictureRows = 6;
inline constexpr std::size_t kPictureCells = kPictureColumns * kPictureRows;

// The cell of a pixel of the left picture. A pixel outside the picture is counted in the nearest cell.
inline std::size_t picture_cell(const StereoCamera& camera, double u, double v) {
  const int column = std::clamp(static_cast<int>((u + 0.5) / camera.width * kPictureColumns), 0, kPictureColumns - 1);
  const int row = std::clamp(static_cast<int>((v + 0.5) / camera.height * kPictureRows), 0, kPictureRows - 1);
  return static_cast<std::size_t>(row * kPictureColumns + column);
}

}  // namespace relmap::place
