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
  std::string serial;         // or GUID; empty: the only camera there is
  std::string camera_folder;  // camera_folder.h; empty: the default one
  std::string calibration;    // a file or folder for load_calibration(), instead of the camera folder's
  double rate_hz = 0;         // of frames; 0: what the camera's settings say, else the fastest
};

// What a camera's settings.yaml asks for. BAD_CONFIG: a mode that there is none of, or features that are none.
Result<iidc::LiveOptions> live_options(const capture::CameraSettings& settings);

// How the two eyes lie in a camera's frames: as it says, or as its settings do.
capture::StereoLayout stereo_layout(const iidc::StreamFormat& format, const capture::CameraSettings& settings);

// A camera that streams with what its folder has for it.
struct OpenedCamera {
  std::unique_ptr<iidc::LiveCamera> live;
  capture::CameraSettings settings;
  capture::StereoLayout layout;
};

// Of options.calibration nothing. Reasons: LiveCamera::open()'s; BAD_CONFIG.
Result<OpenedCamera> open_camera(std::vector<std::shared_ptr<iidc::CameraBus>> buses, const IidcOptions& options,
                                 const std::atomic<bool>& stop);

// Its next frame, unpacked. As LiveCamera::next(); BAD_SIZE.
Result<std::optional<capture::StereoFrame>> next_pair(OpenedCamera& camera);

// For pictures of the layout's size: the one that is named, or the camera folder's. NO_CALIBRATION, BAD_SIZE,
// load_calibration()'s.
Result<StereoCalibration> calibration_of(const OpenedCamera& camera, const IidcOptions& options);

// A source that never ends but by `stop` (within a tenth of a second): count() is 0. next() gives LiveCamera::next()'s
// gaps as its errors, and EYE_DEAD for the eye that is missing from a pair. skip_before() does nothing: what was is
// over.
class IidcSource : public capture::StereoSource {
 public:
  // Reasons: open_camera()'s, calibration_of()'s, Rectifier::make()'s.
  static Result<std::unique_ptr<IidcSource>> open(std::vector<std::shared_ptr<iidc::CameraBus>> buses,
                                                  const IidcOptions& options, const std::atomic<bool>& stop);
  // Thread-safe.
  virtual iidc::LiveCounts counts() const = 0;
  virtual const iidc::CameraAddress& address() const = 0;
};

}  // namespace relmap::iidc
