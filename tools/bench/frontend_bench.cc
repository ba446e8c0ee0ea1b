// relmap-bench frontend: the stereo front-end alone, on pictures with truth: speed, drift, honesty. One thread.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "frontend/imu_feed.h"
#include "frontend/tracking/drift.h"
#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/stamps.h"
#include "frontend/tracking/tracker.h"
#include "proto/geometry/covariance.h"
#include "tools/bench/klt_odometry.h"
#include "tools/bench/picture_drive.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr double kSegments[] = {30, 50};  // metres
constexpr int kTrackedFeatures = 120;
constexpr double kChi2 = 22.46;  // of six degrees of freedom, 0.999

struct FrontendOptions {
  std::string source = "sim", path, reference, scene = "street", faults = "none", track;
  sim::PictureWorldOptions world;
  double circuit_m = 250;
  int seed = 1, seeds = 1;
  std::size_t first = 0;
  double scale = 1;
  bool imu = false;
};

class Stopwatch {
 public:
  double ms() const { return 1e3 * seconds_since(begin_); }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

struct PathError {
  double translation = 0;  // percent
  double rotation = 0;     // degrees per 100 m
};
PathError path_error(const std::vector<tracking::PosePair>& poses) {
  PathError error;
  double lengths = 0;
  for (const double length : kSegments) {
    const tracking::Drift drift = tracking::measure_drift(poses, length);
    if (drift.segments == 0) continue;
    error.translation += 100 * drift.translation;
    error.rotation += 100 * drift.rotation * 180 / M_PI;
    lengths += 1;
  }
  error.translation /= std::max(1.0, lengths);
  error.rotation /= std::max(1.0, lengths);
  return error;
}

// Resident memory of this process, MB.
double resident_mb() {
  std::ifstream in("/proc/self/statm");
  double pages = 0, resident = 0;
  in >> pages >> resident;
  return resident * 4096 / 1e6;
}

// Slope of y over x by least squares; 0 for fewer than two points.
double slope(const std::vector<double>& x, const std::vector<double>& y) {
  const double mx = mean(x), my = mean(y);
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    xy += (x[i] - mx) * (y[i] - my);
  }
  return xx > 0 ? xy / xx : 0;
}

// All drives together.
struct Totals {
  double pairs = 0, tracked = 0, repeated = 0, refused = 0, lost = 0;
  double keyframes = 0, steps = 0, metric_steps = 0, connected_steps = 0;
  double rectify_ms = 0, features_ms = 0, rotation_ms = 0, match_ms = 0, motion_ms = 0, critical_ms = 0;
  double appearance_ms = 0;
  double features = 0, expected = 0, inliers = 0, squares = 0;
  double tracks = 0, track_keyframes = 0;
  std::vector<double> latency_ms, nees, blind_nees, gyro_turn_deg;
  std::vector<double> drift, rotation, offsets;
  double reference_ms = 0;
  std::vector<double> reference_drift, reference_rotation, apart;
  std::vector<double> memory_at, memory_mb;
};

class Drive {
 public:
  Drive(PictureDrive& pictures, const FrontendOptions& options, Totals& totals)
      : pictures_(pictures),
        first_(options.first),
        totals_(totals),
        tracker_(session(pictures.camera()), tracker_options()) {
    if (options.reference == "klt") reference_.emplace(pictures.camera(), kTrackedFeatures);
    if (!options.track.empty()) track_.open(options.track);
    if (options.imu) {
      imu_.emplace(pictures.imu());
      tracker_.use_imu(imu_->calibration(),
                       pictures.rectifier() ? pictures.rectifier()->left_rotation() : Matrix3(Matrix3::Identity()));
    }
  }

  void run() {
    while (auto pair = pictures_.next()) take(std::move(*pair));
    const PathError error = path_error(from_first(poses_));
    totals_.drift.push_back(error.translation);
    totals_.rotation.push_back(error.rotation);
    totals_.offsets.push_back(tracker_.report().offset_px);
    if (!reference_) return;
    const PathError reference_error = path_error(from_first(reference_poses_));
    totals_.reference_drift.push_back(reference_error.translation);
    totals_.reference_rotation.push_back(reference_error.rotation);
    std::vector<tracking::PosePair> both;
    for (std::size_t i = 0; i < poses_.size(); ++i) both.push_back({reference_poses_[i].estimate, poses_[i].estimate});
    totals_.apart.push_back(path_error(both).translation);
  }

 private:
  static SessionHeader session(const StereoCamera& camera) {
    SessionHeader header;
    header.uuid.bytes[0] = 1;
    header.robot = header.name = "bench";
    header.camera = camera;
    return header;
  }
  static tracking::TrackerOptions tracker_options() {
    tracking::TrackerOptions options;
    options.tracks = kTrackedFeatures;
    return options;
  }

  // Those whose truth counts.
  std::vector<tracking::PosePair> from_first(const std::vector<tracking::PosePair>& poses) const {
    return {poses.begin() + static_cast<std::ptrdiff_t>(std::min(first_, poses.size())), poses.end()};
  }

  void take(TruePair pair) {
    const Stopwatch whole;
    capture::StereoFrame frame = std::move(pair.pictures);
    if (pictures_.rectifier()) frame = capture::rectify(*pictures_.rectifier(), std::move(frame)).or_throw();
    totals_.rectify_ms += whole.ms();
    const Stopwatch preparing;
    const auto prepared = tracking::prepare_pair(std::move(frame.left), frame.right);
    totals_.features_ms += preparing.ms();
    totals_.pairs += 1;
    const auto time_us = stamps_.admit(frame.time_us);
    if (!time_us.ok()) {
      totals_.refused += 1;
      return;
    }
    if (imu_) tracker_.feed(imu_->until(*time_us));
    auto keyframe = tracker_.feed(prepared, *time_us).or_throw();
    totals_.critical_ms += whole.ms();
    count(tracker_.report());
    if (tracker_.report().repeated) return;
    poses_.push_back({pair.truth, tracker_.report().T_odom_frame});
    if (track_) write_track(*time_us, pair.truth);
    if (keyframe) {
      const Stopwatch describing;
      keyframe->appearance = tracking::appearance_set(*prepared, *keyframe, tracker_.report().offset_px, 300);
      keyframe->picture = tracking::keyframe_picture(prepared->picture, tracking::KeyframePicture::kWhole);
      totals_.appearance_ms += describing.ms();
      totals_.latency_ms.push_back(whole.ms());
      if (Status status = check_keyframe(*keyframe); !status.ok()) throw StatusError(status);
      count(*keyframe, pair.truth);
    }
    if (reference_) {
      const Stopwatch watch;
      const SE3 pose = reference_->feed(prepared->picture, frame.right);
      totals_.reference_ms += watch.ms();
      reference_poses_.push_back({pair.truth, pose});
    }
    if (static_cast<std::size_t>(totals_.pairs) % 50 == 0) note_memory();
  }

  // The minimum of every thousand pairs, since the pictures that are rendered meanwhile add some megabytes at times.
  void note_memory() {
    const double own = static_cast<double>(poses_.size() + reference_poses_.size()) * sizeof(tracking::PosePair) +
                       static_cast<double>(totals_.nees.size() + totals_.latency_ms.size()) * sizeof(double);
    const double mb = resident_mb() - own / 1e6;
    const auto thousand = static_cast<std::size_t>((totals_.pairs - 1) / 1000);
    if (thousand == totals_.memory_mb.size()) {
      totals_.memory_at.push_back(1000 * static_cast<double>(thousand));
      totals_.memory_mb.push_back(mb);
    }
    totals_.memory_mb.back() = std::min(totals_.memory_mb.back(), mb);
  }

  void count(const tracking::PairReport& report) {
    totals_.repeated += report.repeated;
    if (report.repeated) return;  // its picture is that of an earlier pose
    totals_.features_ms += report.features_ms;
    totals_.rotation_ms += report.rotation_ms;
    totals_.match_ms += report.match_ms;
    totals_.motion_ms += report.motion_ms;
    totals_.tracked += report.tracked;
    totals_.lost += !report.tracked;
    totals_.features += report.found;
    totals_.expected += report.expected;
    totals_.inliers += report.inliers;
    totals_.squares += report.inliers * report.rms_px * report.rms_px;
  }

  void count(const Keyframe& keyframe, const SE3& truth) {
    totals_.keyframes += 1;
    for (const TrackMeasurement& track : keyframe.tracks) {
      totals_.tracks += track.track.sequence == keyframe.sequence;
      totals_.track_keyframes += 1;
    }
    if (last_) {
      totals_.steps += 1;
      totals_.metric_steps += is_vision(keyframe.source);
      totals_.connected_steps += keyframe.source != MotionSource::kUnsensed;
      const SE3 true_step = last_->truth.inverse() * truth;
      const SE3 step = last_->estimate.inverse() * keyframe.T_odom_frame;
      const Vector6 error = (step.inverse() * true_step).log();
      const double nees = mahalanobis_squared(error, keyframe.step_covariance);
      totals_.nees.push_back(nees);
      if (!is_vision(keyframe.source)) totals_.blind_nees.push_back(nees);
      if (keyframe.source == MotionSource::kGyro)
        totals_.gyro_turn_deg.push_back(rotation_angle(step.R.transpose() * true_step.R) * 180 / M_PI);
    }
    last_ = tracking::PosePair{truth, keyframe.T_odom_frame};
  }

  void write_track(std::int64_t time_us, const SE3& truth) {
    const tracking::PairReport& r = tracker_.report();
    const SE3 error = (poses_.size() < 2 ? SE3() : poses_[poses_.size() - 2].truth.inverse() * truth).inverse() *
                      (poses_.size() < 2 ? SE3() : poses_[poses_.size() - 2].estimate.inverse() * r.T_odom_frame);
    track_ << poses_.size() - 1 << ' ' << time_us << " tracked " << r.tracked << " one_eye " << r.one_eye
           << " repeated " << r.repeated << " keyframe " << r.keyframe << " anew " << r.started_anew << " landmarks "
           << r.landmarks << " expected " << r.expected << " found " << r.found << " inliers " << r.inliers << " rms "
           << r.rms_px << " correlation " << r.rotation_correlation << " error_m " << error.t.norm() << " error_deg "
           << rotation_angle(error.R) * 180 / M_PI << '\n';
  }

  PictureDrive& pictures_;
  std::size_t first_;
  Totals& totals_;
  tracking::StereoTracker tracker_;
  tracking::StampFilter stamps_;
  std::optional<KltOdometry> reference_;
  std::ofstream track_;
  std::optional<frontend::ImuFeed> imu_;
  std::vector<tracking::PosePair> poses_, reference_poses_;
  std::optional<tracking::PosePair> last_;
};

void add_figures(const Totals& t, const FrontendOptions& options, Report& report) {
  const auto per_pair = [&](double sum) { return sum / std::max(1.0, t.pairs); };
  const auto share = [](double part, double whole) { return part / std::max(1.0, whole); };
  report.add("frames", t.pairs, "stereo pairs");
  report.add("fps_one_core", 1e3 * t.pairs / t.critical_ms,
             "pairs a second: all but decoding and the appearance set, which is off the critical path");
  report.add("fps_one_core_with_appearance", 1e3 * t.pairs / (t.critical_ms + t.appearance_ms), "that too");
  report.add("ms_rectify", per_pair(t.rectify_ms), "a pair");
  report.add("ms_features", per_pair(t.features_ms), "exposure, pyramids, corners");
  report.add("ms_rotation", per_pair(t.rotation_ms), "between small pictures");
  report.add("ms_match", per_pair(t.match_ms), "patches in time and left to right");
  report.add("ms_motion", per_pair(t.motion_ms), "RANSAC and M-estimate");
  report.add("ms_appearance", share(t.appearance_ms, t.keyframes), "a keyframe: SIFT and picture");
  report.add("latency_p99_ms", quantile(t.latency_ms, 0.99), "picture to described keyframe, on one thread");
  report.add("features_mean", per_pair(t.features), "patches found in a pair");
  report.add("inlier_share", share(t.inliers, t.expected), "of the tracks that should be seen");
  report.add("track_length_mean", share(t.track_keyframes, t.tracks), "keyframes");
  report.add("reprojection_px", std::sqrt(share(t.squares, t.inliers)), "rms of the inliers, a coordinate");
  report.add("drift_percent", mean(t.drift), "translation, of segments of 30 and 50 m");
  report.add("drift_percent_worst", *std::max_element(t.drift.begin(), t.drift.end()), "of the drives");
  report.add("rotation_deg_per_100m", mean(t.rotation), "of the same segments");
  report.add("offset_px", mean(t.offsets), "between the columns of the eyes, as learnt");
  report.add("metric_share", share(t.metric_steps, t.steps), "of the keyframes' steps, measured by vision");
  report.add("topological_share", share(t.connected_steps, t.steps), "of them, connected at all");
  report.add("lost_pairs", t.lost, "whose pose does not come from vision");
  report.add("refused_pairs", t.refused, "for their time stamps");
  report.add("repeated_pairs", t.repeated, "that the camera gave twice");
  report.add("keyframes", t.keyframes, "");
  double above = 0;
  for (const double nees : t.nees) above += nees > kChi2;
  report.add("nees_mean", mean(t.nees), "of the steps between keyframes; 6 is honest");
  report.add("nees_above_share", share(above, static_cast<double>(t.nees.size())), "above chi2_6(0.999)");
  report.add("blind_steps", static_cast<double>(t.blind_nees.size()), "dead-reckoned");
  if (!t.blind_nees.empty()) report.add("blind_nees_mean", mean(t.blind_nees), "");
  if (!t.gyro_turn_deg.empty())
    report.add("gyro_turn_error_deg", *std::max_element(t.gyro_turn_deg.begin(), t.gyro_turn_deg.end()),
               "largest of the steps that the gyro turned");
  if (t.memory_at.size() >= 6) {
    const auto third = static_cast<std::ptrdiff_t>(t.memory_at.size() / 3);
    report.add(
        "memory_slope_mb_per_10000",
        1e4 * slope({t.memory_at.begin() + third, t.memory_at.end()}, {t.memory_mb.begin() + third, t.memory_mb.end()}),
        "least of every thousand pairs, over the last two thirds, less what the benchmark keeps for its figures");
  }
  if (options.reference.empty()) return;
  report.add("reference_fps_one_core", 1e3 * t.pairs / t.reference_ms, "OpenCV: corners, KLT, solvePnPRansac");
  report.add("reference_drift_percent", mean(t.reference_drift), "");
  report.add("reference_rotation_deg_per_100m", mean(t.reference_rotation), "");
  report.add("apart_percent", mean(t.apart), "drift of the two against each other, without truth");
}

void scale(StereoCamera& camera, double by) {
  camera.f *= by;
  camera.cx = (camera.cx + 0.5) * by - 0.5;
  camera.cy = (camera.cy + 0.5) * by - 0.5;
  camera.width = static_cast<int>(camera.width * by);
  camera.height = static_cast<int>(camera.height * by);
}

void run(const FrontendOptions& options, Report& report) {
  cv::setNumThreads(1);
  Totals totals;
  if (!options.path.empty()) {
    const auto pictures = open_recorded_drive(options.source, options.path);
    Drive(*pictures, options, totals).run();
  } else {
    for (int k = 0; k < options.seeds; ++k) {
      const auto seed = static_cast<std::uint64_t>(options.seed + k);
      sim::PictureWorldOptions world = options.world;
      if (options.scene == "motorway") {
        const sim::PictureWorldOptions motorway = sim::motorway_options(seed, world.frames);
        world = motorway;
        world.exposure_s = options.world.exposure_s;
        world.exposure_jumps = options.world.exposure_jumps;
      } else {
        world.laps = world.frames * world.step / options.circuit_m;
      }
      world.seed = seed;
      scale(world.camera, options.scale);
      if (Status status = world.set_faults(options.faults); !status.ok()) throw StatusError(status);
      const auto pictures = open_rendered_drive(world);
      Drive(*pictures, options, totals).run();
    }
  }
  add_figures(totals, options, report);
}

}  // namespace

Run declare_frontend(CLI::App& app) {
  const auto options = std::make_shared<FrontendOptions>();
  options->world.frames = 5000;
  app.footer(
      "Examples:\n"
      "  relmap-bench frontend --source kitti ~/kitti/06 --reference klt   # a data set with poses.txt\n"
      "  relmap-bench frontend --seeds 5 --exposure 0.005 --exposure-jumps 1   # five simulated drives of 1 km\n"
      "  relmap-bench frontend --faults all --rate 20 --step 0.1 --imu   # what can go wrong\n"
      "  relmap-bench frontend --scene motorway --frames 1000 --reference klt\n"
      "  relmap-bench frontend --frames 30000 --scale 0.5   # memory over a long run");
  app.add_option("--source", options->source, "kind of the data set")
      ->check(CLI::IsMember({"kitti", "euroc", "images", "sim", "auto"}))
      ->capture_default_str();
  app.add_option("path", options->path,
                 "folder of the data set, with poses.txt or poses_gt.txt; default: drives are rendered");
  app.add_option("--reference", options->reference,
                 "run also a reference on the same pictures: klt, odometry made of OpenCV's parts")
      ->check(CLI::IsMember({"klt"}));
  app.add_option("--scene", options->scene, "street or motorway")
      ->check(CLI::IsMember({"street", "motorway"}))
      ->capture_default_str();
  app.add_option("--first", options->first, "first pair that is compared with the truth")->capture_default_str();
  app.add_option("--seed", options->seed, "seed of the first simulated drive")->capture_default_str();
  app.add_option("--seeds", options->seeds, "number of simulated drives")->capture_default_str();
  app.add_option("--frames", options->world.frames, "pairs of each drive")->capture_default_str();
  app.add_option("--circuit", options->circuit_m, "length of a street's circuit, metres")->capture_default_str();
  app.add_option("--step", options->world.step, "metres between pairs, in a street")->capture_default_str();
  app.add_option("--scale", options->scale, "scale of the rendered pictures")
      ->check(CLI::Range(0.2, 4.0))
      ->capture_default_str();
  app.add_option("--rate", options->world.rate, "pairs a second")->capture_default_str();
  app.add_option("--exposure", options->world.exposure_s, "exposure time in seconds, for motion blur")
      ->capture_default_str();
  app.add_option("--exposure-jumps", options->world.exposure_jumps, "sudden changes of the gain per 100 pairs")
      ->capture_default_str();
  app.add_option("--faults", options->faults, "none, all, or kind:frame,...")->capture_default_str();
  app.add_flag("--imu", options->imu, "use the inertial unit");
  app.add_option("--track", options->track, "write a line about each pair to this file");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
