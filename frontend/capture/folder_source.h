// A source over pictures whose files and times are known: what all kinds of data sets have in common.
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
  std::vector<PicturePair> pairs;            // at least one; all with a right picture, or none
  std::vector<std::filesystem::path> alone;  // pictures without their other eye
  std::vector<std::string> unseen = {};      // pairs that are told of, and of which there is no picture
  double rate_hz = 0;                        // that times were made from, for want of others
  double max_pixels = 0;                     // larger pictures are reduced to that; 0: none is
  double focal_length = 0;                   // pixels, as the pictures' own files say; 0: they do not
  PassedOver passed_over = {};               // beside pictures that are found by looking into their folder
};

// Finds the size of the pictures and makes the rectifier. Reasons: stereo_source.h.
Result<std::unique_ptr<StereoSource>> open_pictures(PictureSet set, const std::string& calibration_path);

// The left pictures alone, reduced to kReducedPixels. `calibration_path` empty: what the folder holds, and where it
// holds none the set's focal length, or else a usual one. As open_mono_images().
Result<std::unique_ptr<StereoSource>> open_left_pictures(PictureSet set, const std::string& calibration_path);

// KITTI's layout, by whatever `kind` it is called.
Result<std::unique_ptr<StereoSource>> open_kitti_layout(const std::string& kind, const std::string& folder,
                                                        const FolderOptions& options);

// The first of the usual places of two eyes, relative to `folder`, where both are; else the first where the left one
// is, with an empty right one. NO_SUCH_FILE.
using EyePlaces = std::initializer_list<std::pair<const char*, const char*>>;
Result<std::pair<std::filesystem::path, std::filesystem::path>> find_eyes(const std::filesystem::path& folder,
                                                                          EyePlaces places);

}  // namespace relmap::capture
