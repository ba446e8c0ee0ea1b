// Calibration and settings of a camera, by its serial number (or its GUID if it has none).
//
// FOLDER/SERIAL/ holds the calibration, in any form that load_calibration() accepts in a folder, and optionally
// settings.yaml. A calibration alone may also be FOLDER/SERIAL.yaml (.yml, .txt).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "frontend/capture/stereo_layout.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"

namespace relmap::capture {

struct CameraSettings {
  std::string mode;    // "format7.3"; empty for the first mode that carries two eyes
  double rate_hz = 0;  // frames a second, 0.1..240; 0 for the camera's maximum
  // If not set, what the camera says, or otherwise the default of StereoLayout.
  std::optional<FirstByte> first_byte;
  std::optional<ColourFilter> filter;
  // Names and values in the order of the file. A value is "auto", "off", "on", "once", a raw value ("128"), or one in
  // units ("abs 0.0125"); for the trigger it is like "0,7", for the strobe like "0,high,10,200". The camera determines
  // which names and ranges are valid.
  std::vector<std::pair<std::string, std::string>> features;

  bool operator==(const CameraSettings&) const = default;
};

// Parses the text of settings.yaml, in which all keys are optional. BAD_CONFIG; the message has the key and the values
// that it may have.
Result<CameraSettings> parse_camera_settings(std::string_view text);

// $XDG_CONFIG_HOME/relmap/cameras, or ~/.config/relmap/cameras.
std::string default_camera_folder();

// Loads the calibration, which may be of one camera. NO_CALIBRATION if there is none; the message has the places that
// were searched and what to do. Also load_calibration()'s reasons.
Result<StereoCalibration> camera_calibration(const std::string& folder, const std::string& serial);

// Loads the settings; the defaults if there is no file. BAD_CONFIG, with the file; IO_ERROR.
Result<CameraSettings> camera_settings(const std::string& folder, const std::string& serial);

}  // namespace relmap::capture
