#include "tools/bench/picture_drive.h"

#include <algorithm>
#include <thread>

#include "frontend/capture/imu_file.h"
#include "frontend/tracking/bounded_queue.h"
#include "tests/support/drive_evaluation.h"
#include "tools/sim/inertial.h"

namespace relmap::bench {

namespace {

constexpr std::size_t kPairsAhead = 64;  // pairs

class DriveOfRecording : public PictureDrive {
 public:
  DriveOfRecording(std::unique_ptr<capture::StereoSource> source, testing::DriveTruth truth)
      : source_(std::move(source)), truth_(std::move(truth)) {}
  const StereoCamera& camera() const override { return source_->camera(); }
  const vision::Rectifier* rectifier() const override { return &source_->rectifier(); }
  ImuRecording imu() const override {
    if (source_->imu().empty()) return {};
    return capture::read_imu(source_->imu(), source_->calibration().T_body_left).or_throw();
  }
  std::optional<TruePair> next() override {
    if (index_ >= truth_.poses.size()) return std::nullopt;
    auto frame = source_->next().or_throw();
    if (!frame) return std::nullopt;
    if (!frame->eye_missing.ok()) throw StatusError(frame->eye_missing);
    return TruePair{std::move(*frame), truth_.poses[index_++]};
  }

 private:
  std::unique_ptr<capture::StereoSource> source_;
  testing::DriveTruth truth_;
  std::size_t index_ = 0;
};

class RenderedDrive : public PictureDrive {
 public:
  explicit RenderedDrive(const sim::PictureWorldOptions& options) : world_(options), painter_([this] { paint(); }) {}
  ~RenderedDrive() override { ready_.cancel(); }
  const StereoCamera& camera() const override { return world_.options().camera; }
  const vision::Rectifier* rectifier() const override { return nullptr; }
  ImuRecording imu() const override {
    sim::InertialOptions options;
    options.seed = world_.options().seed;
    options.calibration.R_camera_imu = so3_exp({0.02, -0.03, 1.57});
    return {options.calibration, sim::simulate_inertial(world_, options)};
  }
  std::optional<TruePair> next() override { return ready_.pop(); }

 private:
  static vision::Image image_of(const sim::GreyPicture& picture) {
    vision::Image image(picture.width, picture.height);
    std::copy(picture.pixels.begin(), picture.pixels.end(), image.row(0));
    return image;
  }
  void paint() {
    for (int i = 0; i < world_.options().frames; ++i) {
      if (world_.dropped(i)) continue;
      const sim::StereoPictures pictures = world_.render(i);
      if (!ready_.push({{image_of(pictures.left), image_of(pictures.right), world_.time_us(i)}, world_.truth(i)}))
        return;
    }
    ready_.close();
  }

  sim::PictureWorld world_;
  tracking::BoundedQueue<TruePair> ready_{kPairsAhead};
  std::jthread painter_;  // last: it uses all of the above
};

}  // namespace

std::unique_ptr<PictureDrive> open_recorded_drive(const std::string& kind, const std::string& folder) {
  return std::make_unique<DriveOfRecording>(capture::open_source(kind, folder).or_throw(),
                                            testing::read_truth(folder).or_throw());
}

std::unique_ptr<PictureDrive> open_rendered_drive(const sim::PictureWorldOptions& options) {
  if (Status status = options.check(); !status.ok()) throw StatusError(status);
  return std::make_unique<RenderedDrive>(options);
}

}  // namespace relmap::bench
