// Which eye's a picture is, as the names of data sets say.
#pragma once

#include <string>

namespace relmap::cli {

enum class Eye { kNotSaid, kLeft, kRight };

// The folder that it lies in says so, "cam1" (EuRoC), "image_1", "image_01", "image_3", "image_03" (KITTI) or "right",
// or the one above that, if it is EuRoC's or KITTI's ("cam1/data"); where neither does, its own name without the
// ending: "right", "cam1", "cam1_sensor", or what ends with "_right". Left ones likewise.
Eye eye_of_picture(const std::string& path);

// A calibration, a file or a folder, has no folder above: whoever keeps a robot's below "right" says nothing of its
// eyes.
Eye eye_of_calibration(const std::string& path);

}  // namespace relmap::cli
