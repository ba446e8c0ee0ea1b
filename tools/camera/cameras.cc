// Buses, cameras and their pictures, for all commands.
#include <csignal>
#include <filesystem>
#include <utility>

#include "frontend/capture/raw_log.h"
#include "frontend/capture/stereo_source.h"
#include "tools/camera/commands.h"

namespace relmap::camera {

namespace {

std::atomic<bool> g_stop = false;
static_assert(std::atomic<bool>::is_always_lock_free);

class LivePairs : public PairStream {
 public:
  LivePairs(iidc::OpenedCamera camera, iidc::IidcOptions options)
      : camera_(std::move(camera)), options_(std::move(options)) {}

  std::string describe() const override {
    return camera_.live->address().model + ' ' + camera_.live->address().serial + ": " +
           camera_.live->format().describe();
  }
  Result<StereoCalibration> calibration() const override { return iidc::calibration_of(camera_, options_); }
  Result<std::optional<capture::StereoFrame>> next() override { return iidc::next_pair(camera_); }

 private:
  iidc::OpenedCamera camera_;
  const iidc::IidcOptions options_;
};

class LoggedPairs : public PairStream {
 public:
  explicit LoggedPairs(std::unique_ptr<capture::StereoSource> source) : source_(std::move(source)) {}
  std::string describe() const override { return source_->describe(); }
  Result<StereoCalibration> calibration() const override { return source_->calibration(); }
  Result<std::optional<capture::StereoFrame>> next() override {
    if (g_stop) return std::optional<capture::StereoFrame>();
    return source_->next();
  }

 private:
  std::unique_ptr<capture::StereoSource> source_;
};

}  // namespace

const std::atomic<bool>& stop_flag() {
  // A second signal ends the program as usual.
  const auto once = [](int number) {
    g_stop = true;
    std::signal(number, SIG_DFL);
  };
  std::signal(SIGINT, once);
  std::signal(SIGTERM, once);
  return g_stop;
}

std::string folder_of(const GlobalOptions& options) {
  return options.camera_folder.empty() ? capture::default_camera_folder() : options.camera_folder;
}

Result<Registers> open_registers(const GlobalOptions& options, const std::string& serial) {
  auto buses = iidc::open_camera_buses(options.bus);
  if (!buses.ok()) return buses.status();
  auto camera = iidc::choose_camera(*buses, serial);
  if (!camera.ok()) return camera.status();
  auto link = camera->bus->open(camera->address.guid);
  if (!link.ok()) return link.status();
  iidc::CameraAddress address = camera->address;
  auto rom = iidc::identify(**link, address);
  if (!rom) return address.usable;
  return Registers{std::move(*camera), std::move(*link), *std::move(rom)};
}

Result<std::unique_ptr<PairStream>> open_pairs(const GlobalOptions& options, const std::string& camera,
                                               const std::string& calibration, double rate_hz) {
  if (std::filesystem::is_regular_file(camera)) {
    capture::FolderOptions folder;
    folder.calibration = calibration;
    auto source = capture::open_source("raw", camera, folder);
    if (!source.ok()) return source.status();
    return std::unique_ptr<PairStream>(std::make_unique<LoggedPairs>(std::move(*source)));
  }
  auto buses = iidc::open_camera_buses(options.bus);
  if (!buses.ok()) return buses.status();
  const iidc::IidcOptions iidc{camera, options.camera_folder, calibration, rate_hz};
  auto opened = iidc::open_camera(std::move(*buses), iidc, stop_flag());
  if (!opened.ok()) return opened.status();
  return std::unique_ptr<PairStream>(std::make_unique<LivePairs>(std::move(*opened), iidc));
}

}  // namespace relmap::camera
