// Feeds the recording of an inertial unit in step with the pairs.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "frontend/capture/stereo_source.h"
#include "proto/calibration/imu.h"

namespace relmap::frontend {

class ImuFeed {
 public:
  explicit ImuFeed(ImuRecording recording) : recording_(std::move(recording)) {}
  // `wanted` is a file or folder, "none", or "auto" for the data set's recording. Nothing if there is none, or if the
  // recording found by "auto" cannot be read, which is reported on standard error. `quiet` silences what else is said
  // of the recording. The reasons of read_imu().
  static Result<std::optional<ImuFeed>> open(const std::string& wanted, const capture::StereoSource& source,
                                             bool quiet);

  const ImuCalibration& calibration() const { return recording_.calibration; }
  // Returns the next samples up to the first one at or after `time_us`, since a rotation ends between two samples.
  // Times are those of StampFilter, so pairs and samples stay together if the camera's clock is set back.
  std::span<const ImuSample> until(std::int64_t time_us);

 private:
  ImuRecording recording_;
  std::size_t next_ = 0;
};

}  // namespace relmap::frontend
