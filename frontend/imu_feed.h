// A recording of an inertial unit, given out as pairs come.
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
  // `wanted`: a file or folder; "none"; "auto": what the source's data set has. Nothing where there is none, or where
  // auto finds one that cannot be read: then it says so on standard error. read_imu()'s errors.
  static Result<std::optional<ImuFeed>> open(const std::string& wanted, const capture::StereoSource& source,
                                             bool quiet);

  const ImuCalibration& calibration() const { return recording_.calibration; }
  // Samples not given out yet up to the first at or after `time_us`: a turn ends between two samples. By the clock that
  // StampFilter keeps going: a camera's that is set back does not take the pairs away from their samples.
  std::span<const ImuSample> until(std::int64_t time_us);

 private:
  ImuRecording recording_;
  std::size_t next_ = 0;
};

}  // namespace relmap::frontend
