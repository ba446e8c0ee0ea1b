// A folder of photographs of any cameras: the sources of open_mono_images(), one for each camera.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "frontend/capture/picture_folder.h"
#include "frontend/capture/stereo_source.h"

namespace relmap::capture {

struct PhotographFolder {
  struct Camera {
    std::string name;          // picture_camera.h
    std::size_t pictures = 0;  // number of its pictures, with those that cannot be read
    Result<std::unique_ptr<StereoSource>> source;
  };
  std::vector<Camera> cameras;  // the one with the most pictures first
  PassedOver passed_over;
};

// options.camera is ignored. The reasons of open_mono_images().
Result<PhotographFolder> open_photographs(const std::string& folder, const FolderOptions& options = {});

}  // namespace relmap::capture
