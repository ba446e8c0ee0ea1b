// Sources of stereo pairs.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/capture_time.h"
#include "frontend/vision/image.h"
#include "frontend/vision/rectify.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"

namespace relmap::capture {

struct StereoFrame {
  vision::Image left, right;  // grey, 8 bit, not rectified; right is empty if the source has one eye
  std::int64_t time_us = 0;   // UTC
  Status eye_missing = {};    // why one of the two is empty although the source has both
  std::uint64_t index = 0;    // among all pairs of the source, also if reading did not start at the first
  std::string picture = {};   // file name of the left picture
  std::optional<std::chrono::steady_clock::time_point> arrived = {};  // live cameras: when the last byte had arrived
};

// Pictures and whole pairs that a recording should have and lacks.
struct MissingPictures {
  static constexpr std::size_t kNamed = 3;
  std::uint64_t count = 0;
  std::vector<std::string> first;  // at most kNamed of them: their files, or where these should be

  void add(const std::string& name) {
    if (count++ < kNamed) first.push_back(name);
  }
};

// Not thread-safe, except for its rectifier().
class StereoSource {
 public:
  virtual ~StereoSource() = default;

  // The calibration of the raw pictures; of a single camera if the source has one eye.
  virtual const StereoCalibration& calibration() const = 0;
  virtual const vision::Rectifier& rectifier() const = 0;
  // The camera of the rectified pictures; its baseline is 0 if the source has one eye.
  const StereoCamera& camera() const { return rectifier().camera(); }
  // The calibration for a session's header; nothing if the pictures are rectified already, or the camera is assumed.
  std::optional<StereoCalibration> raw_calibration() const;
  // Path of the inertial recording, for read_imu() (imu_file.h); empty if there is none.
  virtual std::string imu() const = 0;

  // Total number of pairs, with those already returned; 0 if unknown.
  virtual std::size_t count() const = 0;
  // Number of pairs that the recording should have: count(), pictures without a counterpart, times without pictures,
  // and lost frames. 0 if unknown.
  virtual std::size_t expected() const { return count(); }
  // What is missing of these, as far as is known without reading them. Nothing for a source of one eye.
  virtual MissingPictures missing() const { return {}; }
  // Number of pictures that belong to no pair, since the other eye has none of that time; describe() names the first.
  virtual std::size_t skipped() const = 0;
  // The rate that was assumed because the recording has no times; speeds and travel times depend on it. 0 if it has
  // them.
  virtual double supposed_rate_hz() const { return 0; }
  // "KITTI data set /data/06: 51 pairs of 1226 x 370", and anything unusual.
  virtual std::string describe() const = 0;
  // One line that distinguishes this recording from others of the same camera, made from its first pair.
  virtual std::string fingerprint() const = 0;
  // A checksum over what is known of all pairs without reading them (names, sizes and times of their pictures), in
  // order. It changes if a pair is added, removed or replaced, and is the same for a copy elsewhere. 0 for a live
  // camera.
  virtual std::uint32_t contents() const = 0;
  // Whether time stamps never decrease, as far as is known, because the clock was not set back.
  virtual bool stamps_rise() const { return true; }
  // Skips pairs with an earlier time stamp without reading them, to continue an interrupted run.
  virtual void skip_before(std::int64_t time_us) = 0;
  // Returns the next pair; nothing at the end. If only one eye's picture is usable, the pair comes with that one. If
  // neither is, returns the error, whose message names the file, and the next call continues with the next pair:
  // NO_SUCH_FILE, IO_ERROR, NOT_A_PICTURE, PICTURE_DAMAGED, PICTURE_TOO_LARGE, BAD_SIZE (not of the calibration's
  // size).
  virtual Result<std::optional<StereoFrame>> next() = 0;
};

// Rectifies the pictures that the frame has. BAD_SIZE, NOT_STEREO.
Result<StereoFrame> rectify(const vision::Rectifier& rectifier, StereoFrame raw);

struct FolderOptions {
  std::string calibration;  // a file or folder for load_calibration(); empty for the data set's folder
  double rate_hz = 10;      // for pairs without times
  std::string camera =
      {};  // for mono pictures, the name of their camera (picture_camera.h); empty if there is only one
};

// All of the following functions refuse with: NO_SUCH_FILE, UNSUPPORTED (pictures of other formats), NOT_STEREO (pairs
// with the calibration of one camera), BAD_SIZE, CORRUPT and TIME_BACKWARDS (times), and the reasons of
// load_calibration(). For formats of pictures see picture_file.h. If only one eye exists, they return a source of one
// eye.

// A KITTI sequence: image_0/ and image_1/ (or image_00/data and image_01/data) with pictures of the same names,
// calib.txt, and optionally times.txt (seconds, one a line).
Result<std::unique_ptr<StereoSource>> open_kitti(const std::string& folder, const FolderOptions& options = {});

// A EuRoC sequence, mav0/ or the folder that holds it: cam0/ and cam1/, each with sensor.yaml, data.csv and data/; or
// without data.csv, with pictures named by nanoseconds in data/ or directly in cam0/ and cam1/ (cam0_sensor.yaml may be
// beside them). Pictures at most 1 ms apart are a pair.
Result<std::unique_ptr<StereoSource>> open_euroc(const std::string& folder, const FolderOptions& options = {});

// A folder of pairs. It uses the first of these that exists:
// - lists of times and file names: left.txt and right.txt, cam0.txt and cam1.txt, or rgb.txt (TUM; its depth is not
//   read). Times are seconds, or stamps as below; pictures at most 1 ms apart are a pair;
// - left/ and right/, image_0/ and image_1/, cam0/ and cam1/ (or their data/), or mav0/ with cam0/ and cam1/: pairs
//   have the same names, or both sides have the same number of pictures, which are paired in the order of their
//   names;
// - the left one of these alone, or pictures directly in the folder.
// Times of folders come from times.txt as above, otherwise from names that are time stamps (19 digits for nanoseconds,
// 16 for microseconds, 13 for milliseconds, UTC), otherwise from the rate.
Result<std::unique_ptr<StereoSource>> open_images(const std::string& folder, const FolderOptions& options = {});

// Pictures of one camera for a mono session: a folder as for open_images(), of two eyes only the left one. Pictures are
// reduced to half a megapixel, as the server reduces the pictures of localisation queries. Without a calibration
// (neither given nor in the folder) they are not rectified, and the focal length comes from their EXIF or is assumed to
// be 1.2 times the longer side; describe() says so. INVALID_ARGUMENT if they are of several cameras and options.camera
// names none.
Result<std::unique_ptr<StereoSource>> open_mono_images(const std::string& folder, const FolderOptions& options = {});

// A raw log (raw_log.h). The calibration is that of the options, or otherwise the log's own. What the camera or the log
// lost comes from next() as an error: an event's reason and message, or CORRUPT and IO_ERROR with the byte.
// NO_SUCH_FILE, also if the log has no frame; CORRUPT, UNKNOWN_FORMAT_VERSION, IO_ERROR; NO_CALIBRATION if there is no
// calibration.
Result<std::unique_ptr<StereoSource>> open_raw_log(const std::string& path, const FolderOptions& options = {});

// Opens a source by the name of its kind: "kitti", "euroc", "images", "sim" (written by relmap-sim pictures), "raw", or
// "auto" for the kind that the folder or file looks like; describe() says which. INVALID_ARGUMENT for another name;
// UNSUPPORTED for a file of keyframes (keyframe_file.h) or a file of an unknown kind.
Result<std::unique_ptr<StereoSource>> open_source(const std::string& kind, const std::string& folder,
                                                  const FolderOptions& options = {});

}  // namespace relmap::capture
