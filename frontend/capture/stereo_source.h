// Where stereo pairs come from.
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
  vision::Image left, right;  // grey, 8 bit, as decoded; right is empty where the source has one eye
  std::int64_t time_us = 0;   // UTC
  Status eye_missing = {};    // why one of the two is empty though the source has both
  std::uint64_t index = 0;    // among all pairs of the source, wherever reading began
  std::string picture = {};   // the left one's file name
  std::optional<std::chrono::steady_clock::time_point> arrived = {};  // of a camera: when its last byte had come
};

// Pictures of pairs, and whole pairs, that a recording tells of and does not have.
struct MissingPictures {
  static constexpr std::size_t kNamed = 3;
  std::uint64_t count = 0;
  std::vector<std::string> first;  // at most kNamed, by their files or by where they should be

  void add(const std::string& name) {
    if (count++ < kNamed) first.push_back(name);
  }
};

// Not thread-safe; its rectifier() is.
class StereoSource {
 public:
  virtual ~StereoSource() = default;

  // Of the raw pictures as they were taken; of one camera where the source has one eye.
  virtual const StereoCalibration& calibration() const = 0;
  virtual const vision::Rectifier& rectifier() const = 0;
  // Of the rectified pictures; baseline 0: one eye.
  const StereoCamera& camera() const { return rectifier().camera(); }
  // The same for a session's header: nothing where the pictures come rectified, or a camera is taken for granted.
  std::optional<StereoCalibration> raw_calibration() const;
  // What an inertial unit said meanwhile, for read_imu() (imu_file.h); empty: the data set has none.
  virtual std::string imu() const = 0;

  // Pairs in all, those given out among them; 0: unknown.
  virtual std::size_t count() const = 0;
  // Pairs that there should be, by all that the recording tells: count(), pictures without their other eye, times
  // without pictures, frames that were lost. 0: unknown.
  virtual std::size_t expected() const { return count(); }
  // What is missing of these, as far as it is known without reading them. Of one eye: nothing.
  virtual MissingPictures missing() const { return {}; }
  // Pictures that belong to no pair, since the other eye has none of that time; describe() names the first.
  virtual std::size_t skipped() const = 0;
  // Pairs a second that are supposed, since nothing tells their times: speeds and travel times are of that. 0: told.
  virtual double supposed_rate_hz() const { return 0; }
  // "KITTI data set /data/06: 51 pairs of 1226 x 370", and what is not as one would expect.
  virtual std::string describe() const = 0;
  // One line that tells this recording from others of the same camera: of its first pair.
  virtual std::string fingerprint() const = 0;
  // A checksum of what there is to know of all its pairs without reading them (names, sizes and times of their
  // pictures), in order: another one where any was added, taken out or exchanged. The same for a copy elsewhere. 0: a
  // camera.
  virtual std::uint32_t contents() const = 0;
  // No pair is stamped earlier than the one before it, as far as is known: the clock was not set back.
  virtual bool stamps_rise() const { return true; }
  // Pairs stamped earlier than that are passed over unread (an interrupted run goes on).
  virtual void skip_before(std::int64_t time_us) = 0;
  // The next pair; nothing at the end. Where only one eye's picture can be had, the pair comes with that one; where
  // none can, its error (NO_SUCH_FILE, IO_ERROR, NOT_A_PICTURE, PICTURE_DAMAGED, PICTURE_TOO_LARGE, BAD_SIZE: not of
  // the calibration's size; the message names the file), and the call after it gives the pair after it.
  virtual Result<std::optional<StereoFrame>> next() = 0;
};

// The pictures that the frame has, rectified, for who needs no stage of its own for it. BAD_SIZE, NOT_STEREO.
Result<StereoFrame> rectify(const vision::Rectifier& rectifier, StereoFrame raw);

struct FolderOptions {
  std::string calibration;  // a file or folder for load_calibration(); empty: what the data set's folder holds
  double rate_hz = 10;      // of pairs without times of their own
  std::string camera = {};  // of mono pictures: which camera's, by its name (picture_camera.h); empty: the only one's
};

// What all of the following refuse: NO_SUCH_FILE, UNSUPPORTED (other formats of pictures), NOT_STEREO (pairs with the
// calibration of one camera), BAD_SIZE, CORRUPT and TIME_BACKWARDS of times, and load_calibration()'s. Pictures:
// picture_file.h. Where only one eye is there, it is a source of one eye.

// A KITTI sequence: image_0/ and image_1/ (or image_00/data and image_01/data) with pictures of the same names,
// calib.txt, and times.txt (seconds; one a line) if there is one.
Result<std::unique_ptr<StereoSource>> open_kitti(const std::string& folder, const FolderOptions& options = {});

// A EuRoC sequence, mav0/ or the folder that holds it: cam0/ and cam1/, each with sensor.yaml, data.csv and data/; or
// without data.csv, with pictures named by nanoseconds in data/ or right there (cam0_sensor.yaml may stand beside).
// Pictures at most 1 ms apart are a pair.
Result<std::unique_ptr<StereoSource>> open_euroc(const std::string& folder, const FolderOptions& options = {});

// A folder of pairs, the first of
// - lists of times and file names: left.txt and right.txt, cam0.txt and cam1.txt, or rgb.txt (TUM; its depth is not
//   read); seconds, or stamps as below; pictures at most 1 ms apart are a pair;
// - left/ and right/, image_0/ and image_1/, cam0/ and cam1/ (or their data/), or mav0/ with the last: of the same
//   names, or as many on each side, in the order of their names;
// - the left one of these alone, or pictures right in the folder.
// Times of folders: times.txt as above, else names that are stamps (19 digits: nanoseconds, 16: microseconds, 13:
// milliseconds, UTC), else the rate.
Result<std::unique_ptr<StereoSource>> open_images(const std::string& folder, const FolderOptions& options = {});

// Pictures of one camera, for a mono session: what open_images() takes, of two eyes the left one. They are reduced to
// half a megapixel, as the server reduces the pictures that it is asked about. Without a calibration (none is named,
// and the folder has none) they are taken as they are, with the focal length that they say themselves, or else 1.2
// times the longer side, and describe() says so. INVALID_ARGUMENT: they are of several cameras, and none of them is
// named.
Result<std::unique_ptr<StereoSource>> open_mono_images(const std::string& folder, const FolderOptions& options = {});

// Frames as a camera sent them (raw_log.h), by the log's own calibration where options name none. What the camera or
// the log lost comes from next() as an error of its own: an event's reason and words, or CORRUPT and IO_ERROR with the
// byte. NO_SUCH_FILE, too: no frame in it; CORRUPT, UNKNOWN_FORMAT_VERSION, IO_ERROR; NO_CALIBRATION: neither has one.
Result<std::unique_ptr<StereoSource>> open_raw_log(const std::string& path, const FolderOptions& options = {});

// By the name of the kind: "kitti", "euroc", "images", "sim" (what relmap-sim pictures wrote), "raw", or "auto": the
// one that the folder or file looks like; describe() says which. INVALID_ARGUMENT: another name; UNSUPPORTED: keyframes
// that are ready made (keyframe_file.h), or a file that is nothing known.
Result<std::unique_ptr<StereoSource>> open_source(const std::string& kind, const std::string& folder,
                                                  const FolderOptions& options = {});

}  // namespace relmap::capture
