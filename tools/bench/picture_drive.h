// Stereo pairs with truth, for the benchmark of the front-end: from a data set, or rendered as they are needed.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "frontend/capture/stereo_source.h"
#include "proto/calibration/imu.h"
#include "proto/geometry/geometry.h"
#include "tools/sim/picture_world.h"

namespace relmap::bench {

struct TruePair {
  capture::StereoFrame pictures;  // raw
  SE3 truth;                      // T_world_left
};

class PictureDrive {
 public:
  virtual ~PictureDrive() = default;
  virtual const StereoCamera& camera() const = 0;
  virtual const vision::Rectifier* rectifier() const = 0;  // for the pictures; null if they are rectified
  virtual ImuRecording imu() const = 0;                    // without samples if there is no inertial unit
  virtual std::optional<TruePair> next() = 0;              // nullopt at the end; throws if a pair cannot be read
};

// Opens a data set that open_source() reads as `kind`, with poses.txt or poses_gt.txt.
std::unique_ptr<PictureDrive> open_recorded_drive(const std::string& kind, const std::string& folder);
// Renders a simulated drive; a thread of its own renders pairs ahead.
std::unique_ptr<PictureDrive> open_rendered_drive(const sim::PictureWorldOptions& options);

}  // namespace relmap::bench
