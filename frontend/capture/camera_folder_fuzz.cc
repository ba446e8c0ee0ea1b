// Any text as the settings of a camera, and as its calibration: they are read, or refused by name, alike from the text
// and from a folder.
#include <filesystem>
#include <string>

#include "frontend/capture/camera_folder.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using namespace relmap::capture;
  using fuzzing::must;
  static const storage::TemporaryFolder kFolder;
  static const std::string kCameras = [] {
    std::filesystem::create_directories(kFolder / "cameras/4711");
    std::filesystem::create_directories(kFolder / "cameras/4712");
    return kFolder / "cameras";
  }();
  const auto settings = parse_camera_settings(fuzzing::text_of({data, size}));
  if (settings.ok()) {
    must(settings->rate_hz == 0 || (settings->rate_hz >= 0.1 && settings->rate_hz <= 240));
    must(settings->mode.empty() || settings->mode.size() == std::string_view("format7.3").size());
    for (const auto& [name, value] : settings->features) must(name == "trigger" || name == "strobe" || !value.empty());
  } else {
    must(settings.reason() == Reason::BAD_CONFIG && !settings.status().message().empty());
  }
  fuzzing::write_file(kCameras + "/4711/settings.yaml", {data, size});
  const auto of_camera = camera_settings(kCameras, "4711");
  must(of_camera.reason() == settings.reason() && (!settings.ok() || *of_camera == *settings));
  must(camera_settings(kCameras, "4713").or_throw() == CameraSettings{});

  fuzzing::write_file(kCameras + "/4713.yaml", {data, size});
  if (const auto calibration = camera_calibration(kCameras, "4713"); calibration.ok())
    must(calibration->check_plausible().ok());
  must(camera_calibration(kCameras, "4712").reason() == Reason::NO_CALIBRATION);
  must(!default_camera_folder().empty());
  return 0;
}
