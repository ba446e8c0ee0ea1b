// Which eye's a picture is, as the names of data sets say.
#pragma once

#include <string>

namespace relmap::cli {

enum class Eye { kNotSaid, kLeft, kRight };

// By the file's name without its ending, then that of its folder, then that of the folder above: "cam1" and
// "cam1_sensor" (EuRoC), "image_1", "image_01", "image_3" and "image_03" (KITTI), "right", or what ends with "_right";
// left ones likewise.
Eye eye_named(const std::string& path);

}  // namespace relmap::cli
