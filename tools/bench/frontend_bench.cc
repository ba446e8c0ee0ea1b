// relmap-bench frontend: the stereo front-end alone, on pictures with truth: speed, drift, honesty.
#include <chrono>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "frontend/tracking/drift.h"
#include "frontend/tracking/tracker.h"
#include "tools/bench/klt_odometry.h"
#include "tools/bench/picture_drive.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

struct Options {
  std::string source = "sim", path, reference;
  PictureWorldOptions world;
  double circuit_m = 250;
  int seeds = 1;
};

class Stopwatch {
 public:
  double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

struct Totals {
  double ms = 0, pairs = 0, tracked = 0, keyframes = 0, found = 0, inliers = 0, features = 0;
  double drift = 0, rotation = 0, drives = 0, rms = 0, expected = 0;
  double offset = 0, rectify_ms = 0, features_ms = 0, rotation_ms = 0, match_ms = 0, motion_ms = 0;
  std::vector<double> nees;
  double reference_ms = 0, reference_drift = 0, reference_rotation = 0;
};

void add_drift(const std::vector<PosePair>& poses, double& translation, double& rotation) {
  double lengths = 0, t = 0, r = 0;
  for (const double length : {30.0, 50.0}) {
    const Drift drift = measure_drift(poses, length);
    if (drift.segments == 0) continue;
    t += drift.translation;
    r += drift.rotation;
    lengths += 1;
  }
  if (lengths == 0) return;
  translation += 100 * t / lengths;
  rotation += r / lengths * 100 * 180 / M_PI;
}

void drive(PictureDrive& drive, const Options& options, Totals& totals) {
  SessionHeader session;
  session.uuid.bytes[0] = 1;
  session.robot = session.name = "bench";
  session.camera = drive.camera();
  StereoTracker tracker(session);
  std::optional<KltOdometry> reference;
  if (options.reference == "klt") reference.emplace(drive.camera(), 120);
  std::vector<PosePair> poses, reference_poses;
  std::optional<PosePair> last;
  while (auto pair = drive.next()) {
    const Stopwatch watch;
    StereoFrame pictures = std::move(pair->pictures);
    if (drive.rectifier()) pictures = rectify(*drive.rectifier(), std::move(pictures)).or_throw();
    totals.rectify_ms += watch.ms();
    const Stopwatch preparing;
    auto prepared = prepare_pair(std::move(pictures.left), pictures.right);
    totals.features_ms += preparing.ms();
    const auto keyframe = tracker.feed(prepared, pictures.time_us).or_throw();
    totals.ms += watch.ms();
    totals.pairs += 1;
    totals.tracked += tracker.report().tracked;
    totals.features_ms += tracker.report().features_ms;
    totals.rotation_ms += tracker.report().rotation_ms;
    totals.match_ms += tracker.report().match_ms;
    totals.motion_ms += tracker.report().motion_ms;
    totals.expected += tracker.report().expected;
    totals.found += tracker.report().found;
    totals.inliers += tracker.report().inliers;
    totals.rms += tracker.report().rms_px;
    totals.features += tracker.report().landmarks;
    poses.push_back({pair->truth, tracker.report().T_odom_frame});
    if (keyframe) {
      totals.keyframes += 1;
      if (last) {
        const SE3 truth = last->truth.inverse() * pair->truth;
        const SE3 step = last->estimate.inverse() * keyframe->T_odom_frame;
        const Vector6 error = (step.inverse() * truth).log();
        totals.nees.push_back(error.dot(keyframe->step_covariance.ldlt().solve(error)));
      }
      last = PosePair{pair->truth, keyframe->T_odom_frame};
    }
    if (reference) {
      const Stopwatch reference_watch;
      const SE3 pose = reference->feed(prepared->picture, pictures.right);
      totals.reference_ms += reference_watch.ms();
      reference_poses.push_back({pair->truth, pose});
    }
  }
  totals.offset = tracker.report().offset_px;
  add_drift(poses, totals.drift, totals.rotation);
  if (reference)
    if (reference) add_drift(reference_poses, totals.reference_drift, totals.reference_rotation);
  totals.drives += 1;
}

void run(Options options, Report& report) {
  cv::setNumThreads(1);
  Totals totals;
  if (options.source == "kitti") {
    drive(*open_recorded_drive(options.path), options, totals);
  } else {
    options.world.laps = options.world.frames * options.world.step / options.circuit_m;
    for (int seed = 1; seed <= options.seeds; ++seed) {
      options.world.seed = static_cast<std::uint64_t>(seed);
      drive(*open_rendered_drive(options.world), options, totals);
    }
  }
  report.add("frames", totals.pairs, "stereo pairs");
  report.add("fps_one_core", 1e3 * totals.pairs / totals.ms, "pairs a second");
  report.add("ms_rectify", totals.rectify_ms / totals.pairs, "");
  report.add("ms_features", totals.features_ms / totals.pairs, "");
  report.add("ms_rotation", totals.rotation_ms / totals.pairs, "");
  report.add("ms_match", totals.match_ms / totals.pairs, "");
  report.add("ms_motion", totals.motion_ms / totals.pairs, "");
  report.add("features_mean", totals.features / totals.pairs, "");
  report.add("inlier_share", totals.inliers / totals.expected, "");
  report.add("found_share", totals.found / totals.features, "");
  report.add("reprojection_px", totals.rms / totals.tracked, "");
  report.add("drift_percent", totals.drift / totals.drives, "");
  report.add("rotation_deg_per_100m", totals.rotation / totals.drives, "");
  report.add("offset_px", totals.offset, "");
  report.add("keyframes", totals.keyframes, "");
  report.add("metric_share", totals.tracked / totals.pairs, "");
  report.add("nees_mean", mean(totals.nees), "");
  report.add("nees_p50", quantile(totals.nees, 0.5), "");
  double above = 0;
  for (const double nees : totals.nees) above += nees > 22.5;
  report.add("nees_above_share", above / static_cast<double>(totals.nees.size()), "");
  if (options.reference == "klt") {
    report.add("reference_fps_one_core", 1e3 * totals.pairs / totals.reference_ms, "");
    report.add("reference_drift_percent", totals.reference_drift / totals.drives, "");
    report.add("reference_rotation_deg_per_100m", totals.reference_rotation / totals.drives, "");
  }
}

}  // namespace

Run declare_frontend(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  options->world.frames = 1000;
  app.add_option("--source", options->source, "kitti or sim")->check(CLI::IsMember({"kitti", "sim"}));
  app.add_option("path", options->path, "folder of the data set, with its truth");
  app.add_option("--reference", options->reference, "klt")->check(CLI::IsMember({"klt"}));
  app.add_option("--seeds", options->seeds, "simulated drives, from seed 1 on");
  app.add_option("--frames", options->world.frames, "of each simulated drive");
  app.add_option("--circuit", options->circuit_m, "metres");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
