// Tells from the names that data sets use which eye of a stereo camera a picture belongs to.
#pragma once

#include <string>

namespace relmap::cli {

enum class Eye { kNotSaid, kLeft, kRight };

// The eye of the picture at `path`, by the first of these names that tells it, upper or lower case:
//   - its folder: "cam1" (EuRoC), "image_1", "image_01", "image_3", "image_03" (KITTI) or "right";
//   - the folder above, if it has EuRoC's or KITTI's name ("cam1/data");
//   - the file without its extension: "right", "cam1", "cam1_sensor", or any name that ends with "_right".
// The names of left pictures correspond (cam0, image_0, left, ...).
Eye eye_of_picture(const std::string& path);

// The same for a calibration, a file or a folder, except that the folder above is not considered: a robot's calibration
// may be kept below any folder called "cam1".
Eye eye_of_calibration(const std::string& path);

}  // namespace relmap::cli
