// What is known of a camera by its serial number (or, where it has none, its GUID): how its eyes are calibrated, and
// what it is to be set to.
//
// FOLDER/SERIAL/ holds the calibration, in any form that load_calibration() finds in a folder, and settings.yaml if the
// camera is not to be taken as it is. A calibration alone may be FOLDER/SERIAL.yaml (.yml, .txt).
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
  std::string mode;    // "format7.3"; empty: the first that carries two eyes
  double rate_hz = 0;  // frames a second, 0.1..240; 0: as fast as the camera can
  // As the camera says, or else as StereoLayout has it.
  std::optional<FirstByte> first_byte;
  std::optional<ColourFilter> filter;
  // Names and values, in the order of the file: "auto", "off", "on", "once", a raw value ("128"), or one in units
  // ("abs 0.0125"); "0,7" of the trigger, "0,high,10,200" of the strobe. Which names there are and how far values go,
  // the camera tells.
  std::vector<std::pair<std::string, std::string>> features;

  bool operator==(const CameraSettings&) const = default;
};

// The text of settings.yaml; none of its keys has to be there. BAD_CONFIG: the key, and what may stand there.
Result<CameraSettings> parse_camera_settings(std::string_view text);

// $XDG_CONFIG_HOME/relmap/cameras, or ~/.config/relmap/cameras.
std::string default_camera_folder();

// NO_CALIBRATION: none, with the places looked at and what to do; or as load_calibration(). It may be of one camera.
Result<StereoCalibration> camera_calibration(const std::string& folder, const std::string& serial);

// Without a file they are the defaults. BAD_CONFIG, with the file; IO_ERROR.
Result<CameraSettings> camera_settings(const std::string& folder, const std::string& serial);

}  // namespace relmap::capture
