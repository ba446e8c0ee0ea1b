// Stereo pairs of a live IIDC camera.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "frontend/capture/camera_folder.h"
#include "frontend/capture/iidc/live_camera.h"
#include "frontend/capture/stereo_layout.h"
#include "frontend/capture/stereo_source.h"

namespace relmap::iidc {

struct IidcOptions {
  std::string serial;         // or GUID; empty if there is only one camera
  std::string camera_folder;  // see camera_folder.h; empty for the default one
  std::string calibration;    // a file or folder for load_calibration(), instead of the camera folder's
  double rate_hz = 0;         // of frames; 0 for that of the camera's settings, or otherwise the fastest
};

// The options in a camera's settings.yaml. BAD_CONFIG if its mode or a feature does not exist.
Result<iidc::LiveOptions> live_options(const capture::CameraSettings& settings);

// How the two eyes are packed in a camera's frames, by its format and its settings.
capture::StereoLayout stereo_layout(const iidc::StreamFormat& format, const capture::CameraSettings& settings);

// A camera that streams, with its settings.
struct OpenedCamera {
  std::unique_ptr<iidc::LiveCamera> live;
  capture::CameraSettings settings;
  capture::StereoLayout layout;
};

// Opens a camera; options.calibration is ignored. The reasons of LiveCamera::open(), and BAD_CONFIG.
Result<OpenedCamera> open_camera(std::vector<std::shared_ptr<iidc::CameraBus>> buses, const IidcOptions& options,
                                 const std::atomic<bool>& stop);

// LiveCamera::next() with the frame unpacked; also BAD_SIZE.
Result<std::optional<capture::StereoFrame>> next_pair(OpenedCamera& camera);

// The calibration for pictures of the layout's size: that of the options, or otherwise the camera folder's.
// NO_CALIBRATION, BAD_SIZE, and the reasons of load_calibration().
Result<StereoCalibration> calibration_of(const OpenedCamera& camera, const IidcOptions& options);

// A source that ends only by `stop` (within a tenth of a second), so count() is 0. next() returns the gaps of
// LiveCamera::next() as errors, and EYE_DEAD as the reason why an eye is missing from a pair. skip_before() does
// nothing.
class IidcSource : public capture::StereoSource {
 public:
  // The reasons of open_camera(), calibration_of() and Rectifier::make().
  static Result<std::unique_ptr<IidcSource>> open(std::vector<std::shared_ptr<iidc::CameraBus>> buses,
                                                  const IidcOptions& options, const std::atomic<bool>& stop);
  // Thread-safe.
  virtual iidc::LiveCounts counts() const = 0;
  virtual const iidc::CameraAddress& address() const = 0;
};

}  // namespace relmap::iidc
