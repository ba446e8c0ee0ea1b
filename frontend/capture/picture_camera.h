// Determines which camera took a picture, as far as its file says. A folder may have photographs of several cameras.
#pragma once

#include <compare>
#include <filesystem>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::capture {

// Pictures of the same size and focal length are taken to be of the same camera.
struct PictureCamera {
  int width = 0, height = 0;  // pixels in the file
  // EXIF's FocalLengthIn35mmFilm: the focal length in whole millimetres for a sensor 36 mm wide. 0 if not known.
  int focal_35mm = 0;

  auto operator<=>(const PictureCamera&) const = default;
  // "4000x3000-26mm", or "640x480" if the focal length is not known.
  std::string name() const;
  // In pixels; 0 if not known.
  double focal_length() const;
};

// The reasons of read_picture_size(): NO_SUCH_FILE, NOT_A_PICTURE, PICTURE_DAMAGED, PICTURE_TOO_LARGE. Damaged EXIF is
// ignored.
Result<PictureCamera> read_picture_camera(const std::filesystem::path& path);

struct PicturesOfCamera {
  PictureCamera camera;
  std::vector<std::filesystem::path> pictures;
};
// Groups pictures by camera, the one with the most pictures first. Pictures that cannot be read go to that camera, so
// that its source reports them. Empty only if `pictures` is.
std::vector<PicturesOfCamera> by_camera(const std::vector<std::filesystem::path>& pictures);

}  // namespace relmap::capture
