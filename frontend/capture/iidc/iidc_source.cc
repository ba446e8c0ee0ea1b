#include "frontend/capture/iidc/iidc_source.h"

#include <string>
#include <utility>

#include "frontend/capture/iidc/eye_watch.h"
#include "proto/calibration/calibration.h"

namespace relmap::iidc {

namespace {

std::string folder_of(const IidcOptions& options) {
  return options.camera_folder.empty() ? capture::default_camera_folder() : options.camera_folder;
}

class LiveSource : public IidcSource {
 public:
  LiveSource(OpenedCamera camera, const StereoCalibration& calibration, vision::Rectifier rectifier)
      : camera_(std::move(camera)), calibration_(calibration), rectifier_(std::move(rectifier)) {}

  const StereoCalibration& calibration() const override { return calibration_; }
  const vision::Rectifier& rectifier() const override { return rectifier_; }
  std::string imu() const override { return {}; }
  std::size_t count() const override { return 0; }
  std::size_t skipped() const override { return 0; }
  std::string describe() const override {
    const iidc::CameraAddress& camera = address();
    std::string text = camera.model + ' ' + camera.serial + " (" + camera.bus + ", " + camera.place +
                       "): " + camera_.live->format().describe();
    if (camera_.layout.filter != capture::ColourFilter::kNone) text += ", colours made grey";
    if (!rectifier_.passes_through()) text += ", to be rectified";
    if (!camera_.live->stamped()) text += "; it stamps no frames: times are those of their arrival";
    return text;
  }
  std::string fingerprint() const override { return "camera " + address().serial; }
  std::uint32_t contents() const override { return 0; }
  void skip_before(std::int64_t) override {}
  iidc::LiveCounts counts() const override { return camera_.live->counts(); }
  const iidc::CameraAddress& address() const override { return camera_.live->address(); }

  Result<std::optional<capture::StereoFrame>> next() override {
    auto pair = next_pair(camera_);
    if (!pair.ok() || !pair->has_value()) return pair;
    capture::StereoFrame& frame = **pair;
    const EyeWatch::Verdict verdict = eyes_.look(frame.left, frame.right);
    if (!verdict.left.ok()) frame.left = {};
    if (!verdict.right.ok()) frame.right = {};
    frame.eye_missing = verdict.left.ok() ? verdict.right : verdict.left;
    return pair;
  }

 private:
  OpenedCamera camera_;
  const StereoCalibration calibration_;
  const vision::Rectifier rectifier_;
  EyeWatch eyes_;
};

}  // namespace

Result<iidc::LiveOptions> live_options(const capture::CameraSettings& settings) {
  iidc::LiveOptions live;
  live.wish.rate_hz = settings.rate_hz;
  if (!settings.mode.empty()) {
    live.wish.mode = iidc::VideoMode::parse(settings.mode);
    if (!live.wish.mode)
      return {Reason::BAD_CONFIG, "mode: '" + settings.mode + "' is none; they are called format7.3, format0.6, ..."};
  }
  for (const auto& [name, value] : settings.features) {
    if (name == iidc::feature_name(iidc::Feature::kTrigger)) {
      const auto trigger = iidc::TriggerSetting::parse(value);
      if (!trigger.ok()) return {Reason::BAD_CONFIG, "features: " + trigger.status().message()};
      live.trigger = *trigger;
      continue;
    }
    if (name == "strobe") {
      const auto strobe = iidc::StrobeSetting::parse(value);
      if (!strobe.ok()) return {Reason::BAD_CONFIG, "features: " + strobe.status().message()};
      live.strobes.push_back(*strobe);
      continue;
    }
    const auto feature = iidc::FeatureSetting::parse(name, value);
    if (!feature.ok()) return {Reason::BAD_CONFIG, "features: " + feature.status().message()};
    live.features.push_back(*feature);
  }
  return live;
}

capture::StereoLayout stereo_layout(const iidc::StreamFormat& format, const capture::CameraSettings& settings) {
  capture::StereoLayout layout;
  layout.width = format.width;
  layout.height = format.height;
  layout.filter = settings.filter.value_or(format.filter);
  layout.first_byte = settings.first_byte.value_or(layout.first_byte);
  return layout;
}

Result<OpenedCamera> open_camera(std::vector<std::shared_ptr<iidc::CameraBus>> buses, const IidcOptions& options,
                                 const std::atomic<bool>& stop) {
  // The settings depend on the serial number, so the camera is chosen before it is opened.
  const auto chosen = iidc::choose_camera(buses, options.serial);
  if (!chosen.ok()) return chosen.status();
  OpenedCamera camera;
  auto settings = capture::camera_settings(folder_of(options), chosen->address.serial);
  if (!settings.ok()) return settings.status();
  camera.settings = std::move(*settings);
  auto live = live_options(camera.settings);
  if (!live.ok()) return live.status();
  live->serial = iidc::guid_text(chosen->address.guid);
  if (options.rate_hz > 0) live->wish.rate_hz = options.rate_hz;
  auto opened = iidc::LiveCamera::open(std::move(buses), *live, stop);
  if (!opened.ok()) return opened.status();
  camera.live = std::move(*opened);
  camera.layout = stereo_layout(camera.live->format(), camera.settings);
  return camera;
}

Result<std::optional<capture::StereoFrame>> next_pair(OpenedCamera& camera) {
  auto live = camera.live->next();
  if (!live.ok()) return live.status();
  if (!live->has_value()) return std::optional<capture::StereoFrame>();
  capture::StereoFrame frame;
  frame.time_us = (*live)->time_us;
  frame.index = (*live)->index;
  frame.arrived = (*live)->arrived;
  if (Status status = capture::unpack(camera.layout, (*live)->raw.bytes(), frame.left, frame.right); !status.ok())
    return status;
  return std::optional<capture::StereoFrame>(std::move(frame));
}

Result<StereoCalibration> calibration_of(const OpenedCamera& camera, const IidcOptions& options) {
  auto calibration = options.calibration.empty()
                         ? capture::camera_calibration(folder_of(options), camera.live->address().serial)
                         : load_calibration(options.calibration);
  if (!calibration.ok()) return calibration;
  const capture::StereoLayout& layout = camera.layout;
  if (calibration->mono())
    return {Reason::NOT_STEREO, "the calibration of " + camera.live->address().serial + " is of one eye"};
  if (calibration->width == 0) calibration->width = layout.width, calibration->height = layout.height;
  if (calibration->width != layout.width || calibration->height != layout.height)
    return {Reason::BAD_SIZE, "the calibration is of pictures of " + std::to_string(calibration->width) + " x " +
                                  std::to_string(calibration->height) + ", but the camera sends " +
                                  camera.live->format().describe()};
  return calibration;
}

Result<std::unique_ptr<IidcSource>> IidcSource::open(std::vector<std::shared_ptr<iidc::CameraBus>> buses,
                                                     const IidcOptions& options, const std::atomic<bool>& stop) {
  auto camera = open_camera(std::move(buses), options, stop);
  if (!camera.ok()) return camera.status();
  const auto calibration = calibration_of(*camera, options);
  if (!calibration.ok()) return calibration.status();
  auto rectifier = vision::Rectifier::make(*calibration, camera->layout.width, camera->layout.height);
  if (!rectifier.ok()) return rectifier.status();
  return std::unique_ptr<IidcSource>(
      std::make_unique<LiveSource>(std::move(*camera), *calibration, std::move(*rectifier)));
}

}  // namespace relmap::iidc
