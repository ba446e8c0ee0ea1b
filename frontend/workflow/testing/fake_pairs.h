// A source of stereo pairs, a short drive along a rendered street, which the test can alter.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frontend/capture/iidc/iidc_source.h"
#include "frontend/capture/stereo_source.h"
#include "tools/sim/picture_world.h"

namespace relmap::workflow::testing_pairs {

inline constexpr int kPairs = 12;
inline const StereoCamera kDriveCamera{
    .f = 250, .cx = 159.5, .cy = 119.5, .baseline = 0.12, .width = 320, .height = 240};

// Rendered once.
inline const std::vector<capture::StereoFrame>& street() {
  static const std::vector<capture::StereoFrame> pairs = [] {
    cv::setNumThreads(1);  // ThreadSanitizer does not know how OpenCV's threads synchronise
    sim::PictureWorldOptions options;
    options.seed = 12;
    options.step = 0.4;
    options.frames = 120;
    options.camera = kDriveCamera;
    const sim::PictureWorld world(options);
    const auto image_of = [](const sim::GreyPicture& picture) {
      vision::Image image(picture.width, picture.height);
      std::copy(picture.pixels.begin(), picture.pixels.end(), image.row(0));
      return image;
    };
    std::vector<capture::StereoFrame> rendered;
    for (int i = 0; i < kPairs; ++i) {
      const sim::StereoPictures pictures = world.render(i);
      capture::StereoFrame& pair = rendered.emplace_back();
      pair.left = image_of(pictures.left);
      pair.right = image_of(pictures.right);
      pair.time_us = world.time_us(i);
      pair.index = static_cast<std::uint64_t>(i);
      pair.picture = std::to_string(i) + ".png";
    }
    return rendered;
  }();
  return pairs;
}

// What a source returns.
struct Script {
  Script() {
    for (const capture::StereoFrame& pair : street()) pairs.emplace_back(pair);
  }
  std::vector<Result<capture::StereoFrame>> pairs;  // an error is a pair that cannot be read
  bool one_eye = false, stamps_rise = true;
  std::function<void(std::size_t)> before = [](std::size_t) {};  // called before each next(), with its number
};

template <typename Source = capture::StereoSource>
class FakePairs : public Source {
 public:
  explicit FakePairs(Script script) : script_(std::move(script)) {
    calibration_.left = {.fx = kDriveCamera.f, .fy = kDriveCamera.f, .cx = kDriveCamera.cx, .cy = kDriveCamera.cy};
    if (!script_.one_eye) calibration_.right = calibration_.left;
    calibration_.T_right_left.t = {script_.one_eye ? 0 : -kDriveCamera.baseline, 0, 0};
    calibration_.rectified = true;
    rectifier_.emplace(vision::Rectifier::make(calibration_, kDriveCamera.width, kDriveCamera.height).or_throw());
  }
  const StereoCalibration& calibration() const override { return calibration_; }
  const vision::Rectifier& rectifier() const override { return *rectifier_; }
  std::string imu() const override { return {}; }
  std::size_t count() const override { return script_.pairs.size(); }
  std::size_t skipped() const override { return 0; }
  std::string describe() const override { return "a street"; }
  std::string fingerprint() const override { return "street"; }
  std::uint32_t contents() const override { return 7; }
  bool stamps_rise() const override { return script_.stamps_rise; }
  void skip_before(std::int64_t time_us) override {
    while (next_ < script_.pairs.size() && script_.pairs[next_].ok() && script_.pairs[next_]->time_us < time_us)
      ++next_;
  }
  Result<std::optional<capture::StereoFrame>> next() override {
    script_.before(next_);
    if (next_ >= script_.pairs.size()) return std::optional<capture::StereoFrame>();
    const auto& pair = script_.pairs[next_++];
    if (!pair.ok()) return pair.status();
    return std::optional(*pair);
  }

 private:
  Script script_;
  StereoCalibration calibration_;
  std::optional<vision::Rectifier> rectifier_;
  std::size_t next_ = 0;
};

class FakeCamera final : public FakePairs<iidc::IidcSource> {
 public:
  FakeCamera(Script script, iidc::LiveCounts counts) : FakePairs(std::move(script)), counts_(std::move(counts)) {
    address_.serial = "7140058";
  }
  std::size_t count() const override { return 0; }
  iidc::LiveCounts counts() const override { return counts_; }
  const iidc::CameraAddress& address() const override { return address_; }

 private:
  iidc::LiveCounts counts_;
  iidc::CameraAddress address_;
};

}  // namespace relmap::workflow::testing_pairs
