#include "frontend/workflow/outside.h"

#include <utility>

#include "frontend/capture/dc1394/camera_buses.h"

namespace relmap::workflow {

Result<std::unique_ptr<capture::StereoSource>> open_recording(const RunOptions& options) {
  return capture::open_source(options.source, options.path, {.calibration = options.calibration});
}

Result<OpenCamera> find_cameras(const std::string& bus) {
  auto buses = iidc::open_camera_buses(bus);
  if (!buses.ok()) return buses.status();
  return OpenCamera([on = std::move(*buses)](const iidc::IidcOptions& options, const std::atomic<bool>& stop) {
    return iidc::IidcSource::open(on, options, stop);
  });
}

}  // namespace relmap::workflow
