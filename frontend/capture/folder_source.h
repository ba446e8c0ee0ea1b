// A source of pictures whose files and times are known. All kinds of data sets use it.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "frontend/capture/picture_folder.h"
#include "frontend/capture/stereo_source.h"

namespace relmap::capture {

struct PictureSet {
  std::string kind;  // "KITTI data set"
  std::filesystem::path folder;
  std::vector<PicturePair> pairs;            // at least one; either all or none have a right picture
  std::vector<std::filesystem::path> alone;  // pictures without a counterpart of the other eye
  std::vector<std::string> unseen = {};      // pairs that a list names and that have no picture
  double rate_hz = 0;                        // the rate from which times were made, if there are no others; 0 otherwise
  double max_pixels = 0;                     // larger pictures are reduced to this; 0 for no limit
  double focal_length = 0;                   // pixels, from the pictures' EXIF; 0 if not known
  PassedOver passed_over = {};               // other files and folders in the folder of the pictures
};

// Finds the size of the pictures and makes the rectifier. Reasons: stereo_source.h.
Result<std::unique_ptr<StereoSource>> open_pictures(PictureSet set, const std::string& calibration_path);

// Opens the left pictures alone, reduced to kReducedPixels, as open_mono_images() does. If `calibration_path` is empty,
// it uses the folder's calibration, or otherwise the set's focal length, or otherwise a usual one.
Result<std::unique_ptr<StereoSource>> open_left_pictures(PictureSet set, const std::string& calibration_path);

// Opens a folder in KITTI's layout; `kind` is what describe() calls it.
Result<std::unique_ptr<StereoSource>> open_kitti_layout(const std::string& kind, const std::string& folder,
                                                        const FolderOptions& options);

// Returns the first of `places` (relative to `folder`) where both eyes exist; otherwise the first where the left one
// does, with an empty right one. NO_SUCH_FILE.
using EyePlaces = std::initializer_list<std::pair<const char*, const char*>>;
Result<std::pair<std::filesystem::path, std::filesystem::path>> find_eyes(const std::filesystem::path& folder,
                                                                          EyePlaces places);

}  // namespace relmap::capture
