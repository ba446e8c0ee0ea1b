// Where stereo pairs come from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "frontend/vision/image.h"
#include "frontend/vision/rectify.h"
#include "proto/camera.h"
#include "proto/status.h"

namespace relmap {

struct StereoFrame {
  Image left, right;         // grey, 8 bit, as decoded: rectifier() makes pictures of camera() of them
  std::int64_t time_us = 0;  // UTC
};

// Not thread-safe.
class StereoSource {
 public:
  virtual ~StereoSource() = default;

  virtual const Rectifier& rectifier() const = 0;
  // Of the rectified pictures.
  const StereoCamera& camera() const { return rectifier().camera(); }
  // Pairs in all, those given out among them; 0: unknown.
  virtual std::size_t count() const = 0;
  // "KITTI data set /data/06: 51 pairs of 1226 x 370"
  virtual std::string describe() const = 0;
  // Pairs older than that are passed over unread (an interrupted run goes on).
  virtual void skip_before(std::int64_t time_us) = 0;
  // The next pair; nothing at the end. After an error (NO_SUCH_FILE, NOT_A_PICTURE, PICTURE_DAMAGED,
  // PICTURE_TOO_LARGE, BAD_SIZE; the message names the file) the call after it gives the pair after it.
  virtual Result<std::optional<StereoFrame>> next() = 0;
};

// Both pictures rectified, for who needs no stage of its own for it. BAD_SIZE.
Result<StereoFrame> rectify(const Rectifier& rectifier, StereoFrame raw);

// The moment at which data sets without absolute time are placed: 2020-01-01 00:00:00 UTC.
inline constexpr std::int64_t kRelativeTimeBaseUs = 1'577'836'800'000'000;

struct FolderOptions {
  std::string calibration;  // a file or folder for load_calibration(); empty: what the data set's folder holds
  double rate_hz = 10;      // of pairs without times of their own
};

// A KITTI sequence: image_0/ and image_1/ (or image_00/data and image_01/data) with pictures of the same names,
// calib.txt, and times.txt (seconds; one a line) if there is one. NO_SUCH_FILE, BAD_SIZE, and load_calibration()'s.
Result<std::unique_ptr<StereoSource>> open_kitti(const std::string& folder, const FolderOptions& options = {});

// A folder of pairs: left/ and right/, image_0/ and image_1/, cam0/ and cam1/ (or their data/), or mav0/ with the last;
// of the same names, or as many on each side, in the order of their names. Times: times.txt as above, else names
// that are numbers (19 digits: nanoseconds, 16: microseconds, 13: milliseconds, UTC), else the rate.
Result<std::unique_ptr<StereoSource>> open_images(const std::string& folder, const FolderOptions& options = {});

}  // namespace relmap
