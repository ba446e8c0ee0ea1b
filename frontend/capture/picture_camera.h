// Which camera took a picture, as far as its file says: photographs of several cameras lie in one folder.
#pragma once

#include <compare>
#include <filesystem>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::capture {

// Pictures of one size and one focal length are one camera's.
struct PictureCamera {
  int width = 0, height = 0;  // pixels, as the file has them
  // Millimetres before a sensor of 36 mm width, to the nearest whole: EXIF's FocalLengthIn35mmFilm. 0: not said.
  int focal_35mm = 0;

  auto operator<=>(const PictureCamera&) const = default;
  // "4000x3000-26mm", or "640x480" where the focal length is not said.
  std::string name() const;
  // Pixels of the picture; 0: not said.
  double focal_length() const;
};

// NO_SUCH_FILE, NOT_A_PICTURE, PICTURE_DAMAGED, PICTURE_TOO_LARGE: as read_picture_size(). EXIF that is damaged says
// nothing.
Result<PictureCamera> read_picture_camera(const std::filesystem::path& path);

struct PicturesOfCamera {
  PictureCamera camera;
  std::vector<std::filesystem::path> pictures;
};
// The cameras of these pictures, that with most pictures first; a picture that cannot be read is that one's, so that it
// is named where it is taken in. Not empty unless `pictures` is.
std::vector<PicturesOfCamera> by_camera(const std::vector<std::filesystem::path>& pictures);

}  // namespace relmap::capture
