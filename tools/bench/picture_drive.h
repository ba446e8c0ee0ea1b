// Stereo pairs with truth, for the benchmark of the front-end: a data set, or a world rendered on the way.
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
  virtual const vision::Rectifier* rectifier() const = 0;  // that the pictures need; null: none
  virtual ImuRecording imu() const = 0;                    // without samples if there is no unit
  virtual std::optional<TruePair> next() = 0;              // nothing at the end; throws what cannot be read
};

// A folder that open_source() reads, of `kind`, with poses.txt or poses_gt.txt.
std::unique_ptr<PictureDrive> open_recorded_drive(const std::string& kind, const std::string& folder);
// Pairs are rendered ahead by a thread of its own.
std::unique_ptr<PictureDrive> open_rendered_drive(const sim::PictureWorldOptions& options);

}  // namespace relmap::bench
