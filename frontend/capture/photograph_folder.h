// A folder of photographs, whatever cameras took them: what open_mono_images() takes, camera by camera.
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
    std::size_t pictures = 0;  // that are its, or cannot be read
    Result<std::unique_ptr<StereoSource>> source;
  };
  std::vector<Camera> cameras;  // that with most pictures first
  PassedOver passed_over;
};

// options.camera chooses nothing here. Reasons: open_mono_images()'s.
Result<PhotographFolder> open_photographs(const std::string& folder, const FolderOptions& options = {});

}  // namespace relmap::capture
