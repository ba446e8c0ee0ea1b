#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <vector>

#include "frontend/capture/stereo_source.h"
#include "frontend/tracking/tracker.h"
#include "tests/support/simulated_drive.h"
#include "tools/bench/euclidean_ba.h"
#include "tools/bench/plot.h"
#include "tools/bench/rba_measures.h"
#include "tools/bench/rba_scenarios.h"
#include "tools/bench/recorded_drive.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kChain = 20;  // frames
constexpr int kPrefixes = 12;         // of the drive, for the figure

// The Euclidean solution knows nothing of the robots' own steps.
rba::RbaOptions of_measurements_alone(std::uint32_t window) {
  rba::RbaOptions rba = with_window(window);
  rba.own_step = 0;
  return rba;
}

// The transforms between frames i and i + kChain, for all i.
using Chains = std::vector<SE3>;
Chains chains(std::uint32_t frames, const std::function<SE3(std::uint32_t i, std::uint32_t j)>& T) {
  Chains all;
  for (std::uint32_t i = 0; i + kChain < frames; ++i) all.push_back(T(i, i + kChain));
  return all;
}
// Of the relative map: along the odometry edges.
Chains chains_of_map(const testing::SimulatedDrive& drive, storage::Map& map) {
  return chains(drive.driven(), [&](std::uint32_t i, std::uint32_t j) {
    SE3 T;
    for (std::uint32_t k = i + 1; k <= j; ++k) T = T * map.hot(drive.frame(k))->edges.front().T_ab;
    return T;
  });
}

// |dt| / |t| of each chain.
std::vector<double> differences(const Chains& a, const Chains& b) {
  std::vector<double> all;
  for (std::size_t k = 0; k < a.size(); ++k) all.push_back((a[k].t - b[k].t).norm() / b[k].t.norm());
  return all;
}
double mean_square(const Chains& a, const Chains& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k].t - b[k].t).squaredNorm();
  return sum / static_cast<double>(a.size());
}

// Chains of the adaptive, the full relative and the Euclidean solution of figure eights.
struct ChainComparison {
  std::vector<double> full, adaptive;                 // against Euclidean; against full
  double adaptive_square = 0, full_error_square = 0;  // mean over seeds: against full; of full against truth

  void add(const sim::PointsWorldOptions& world, const EuclideanOptions& options, bool closures) {
    testing::SimulatedDrive drive(world, of_measurements_alone(options.window), {.proposed = closures});
    drive.drive();
    const Chains adaptive_chains = chains_of_map(drive, drive.map());
    drive.relax_fully();
    const Chains full_chains = chains_of_map(drive, drive.map());
    EuclideanBa euclidean(drive.map());
    euclidean.solve(rba::RbaOptions().huber_px);
    const Chains euclidean_chains = chains(drive.driven(), [&](std::uint32_t i, std::uint32_t j) {
      return euclidean.T_world_frame(drive.frame(i)).inverse() * euclidean.T_world_frame(drive.frame(j));
    });
    const Chains truth = chains(drive.driven(), [&](std::uint32_t i, std::uint32_t j) {
      return drive.world().T_world_frame(i).inverse() * drive.world().T_world_frame(j);
    });
    for (const double d : differences(full_chains, euclidean_chains)) full.push_back(d);
    for (const double d : differences(adaptive_chains, full_chains)) adaptive.push_back(d);
    adaptive_square += mean_square(adaptive_chains, full_chains);
    full_error_square += mean_square(full_chains, truth);
  }
};

SessionHeader header(const std::string& name, const StereoCamera& camera) {
  SessionHeader session;
  session.uuid.bytes[0] = 1;
  session.robot = "recorded";
  session.name = name;
  session.camera = camera;
  return session;
}

std::ifstream open(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw StatusError(Status(Reason::NO_SUCH_FILE, path));
  return in;
}

// 26 cameras of a street: "camera landmark u_left u_right v X Y Z" a line; poses as 4x4 matrices by rows.
std::vector<Keyframe> read_stereo_factors(const std::string& folder) {
  std::ifstream calibration = open(folder + "/VO_calibration.txt");
  double fx = 0, fy = 0, skewness = 0, cx = 0, cy = 0, baseline = 0;
  calibration >> fx >> fy >> skewness >> cx >> cy >> baseline;
  const SessionHeader session = header("stereo factors", {fx, cx, cy, baseline, 1242, 375});
  std::vector<Keyframe> keyframes;
  std::ifstream poses = open(folder + "/VO_camera_poses_large.txt");
  for (std::uint32_t number = 0; poses >> number;) {
    Keyframe keyframe;
    keyframe.session = session;
    keyframe.sequence = static_cast<std::uint32_t>(keyframes.size());
    keyframe.time_us = 1'000'000'000 + 100'000 * std::int64_t{keyframe.sequence};
    Eigen::Matrix4d T;
    for (int k = 0; k < 16; ++k) poses >> T(k / 4, k % 4);
    keyframe.T_odom_frame = SE3{T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()}.normalized();
    if (!keyframes.empty()) {
      keyframe.source = MotionSource::kVision;
      keyframe.step_covariance.diagonal() << Vector3::Constant(0.05 * 0.05), Vector3::Constant(0.01 * 0.01);
      keyframe.driven_us = 100'000;
    }
    keyframes.push_back(std::move(keyframe));
  }
  std::map<std::uint32_t, TrackId> tracks;
  std::ifstream factors = open(folder + "/VO_stereo_factors_large.txt");
  for (std::string line; std::getline(factors, line);) {
    std::istringstream fields(line);
    std::uint32_t camera = 0, landmark = 0;
    TrackMeasurement z;
    if (!(fields >> camera >> landmark >> z.u_left >> z.u_right >> z.v) || camera < 1 || camera > keyframes.size())
      throw StatusError(Status(Reason::CORRUPT, folder + ": " + line));
    Keyframe& keyframe = keyframes[camera - 1];
    z.track =
        tracks.try_emplace(landmark, TrackId{keyframe.sequence, static_cast<std::uint32_t>(keyframe.tracks.size())})
            .first->second;
    keyframe.tracks.push_back(z);
  }
  return keyframes;
}

std::vector<Keyframe> track_recording(const std::string& folder) {
  auto source = capture::open_kitti(folder).or_throw();
  tracking::StereoTracker tracker(header("street", source->camera()));
  std::vector<Keyframe> keyframes;
  while (auto frame = source->next().or_throw())
    if (auto keyframe =
            tracker.feed(tracking::prepare_pair(std::move(frame->left), frame->right), frame->time_us).or_throw())
      keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

void compare_on(const std::vector<Keyframe>& keyframes, const std::string& name, const EuclideanOptions& options,
                Report& report) {
  RecordedDrive drive(of_measurements_alone(options.window));
  for (const Keyframe& keyframe : keyframes) drive.add(keyframe);
  const double huber = rba::RbaOptions().huber_px;
  EuclideanBa ceres(drive.map());
  const double adaptive_rms = ceres.rms_px();
  const auto outcome = ceres.solve(huber);
  drive.relax_fully();
  EuclideanBa full(drive.map());
  const double full_cost = full.solve(huber, 0).cost_before;
  report.add(name + "_frames", static_cast<double>(ceres.frames()), "");
  report.add(name + "_measurements", static_cast<double>(ceres.observations()), "");
  report.add(name + "_update_p50_us", quantile(drive.update_us(), 0.5), "as the map grew");
  report.add(name + "_update_p99_us", quantile(drive.update_us(), 0.99), "");
  report.add(name + "_cost_adaptive", outcome.cost_before, "Huber-robust, of the map as it grew");
  report.add(name + "_cost_full", full_cost, "of the full relative solution");
  report.add(name + "_cost_ceres", outcome.cost_after,
             outcome.converged ? "of the Euclidean one, converged" : "of the Euclidean one, not converged");
  report.add(name + "_full_over_ceres", full_cost / outcome.cost_after, "");
  report.add(name + "_rms_px", adaptive_rms, "reprojection, per coordinate");
  report.add(name + "_rms_px_full", full.rms_px(), "");
  report.add(name + "_ceres_full_rms_px", ceres.rms_px(), "");
}

}  // namespace

void run_euclidean(const EuclideanOptions& options, Report& report) {
  ChainComparison open_loop, closed;
  std::vector<double> frames, adaptive, full, ceres;  // sums of squares
  for (int seed = 1; seed <= options.seeds; ++seed) {
    const sim::PointsWorldOptions world = figure8_world(seed, options.births);
    open_loop.add(world, options, false);
    closed.add(world, options, true);
    if (seed > 1) continue;
    for (int k = 1; k <= kPrefixes; ++k) {
      testing::SimulatedDrive drive(world, of_measurements_alone(options.window));
      drive.drive(world.frames * static_cast<std::uint32_t>(k) / kPrefixes);
      frames.push_back(drive.driven());
      const double adaptive_rms = reprojection_rms(drive.map());
      drive.relax_fully();
      const double full_rms = reprojection_rms(drive.map());
      EuclideanBa euclidean(drive.map());
      euclidean.solve(rba::RbaOptions().huber_px);
      const double coordinates = 3 * static_cast<double>(euclidean.observations());
      adaptive.push_back(coordinates * adaptive_rms * adaptive_rms);
      full.push_back(coordinates * full_rms * full_rms);
      ceres.push_back(coordinates * euclidean.rms_px() * euclidean.rms_px());
    }
  }
  report.add("seeds", options.seeds, "");
  report.add("window", options.window, "frames that a new one activates");
  const auto add_chains = [&](const ChainComparison& of, const std::string& suffix, const std::string& where) {
    report.add("chain_full_over_euclidean_mean" + suffix, mean(of.full), "|dt|/|t| over 20 frames, " + where);
    report.add("chain_full_over_euclidean_max" + suffix, quantile(of.full, 1), "");
    report.add("chain_adaptive_over_full_mean" + suffix, mean(of.adaptive), "");
    report.add("chain_adaptive_over_full_max" + suffix, quantile(of.adaptive, 1), "");
    report.add("chain_adaptive_sigmas" + suffix, std::sqrt(of.adaptive_square / of.full_error_square),
               "adaptive from full, over the full solution's own error; root mean squares");
  };
  add_chains(open_loop, "", "no loop closed");
  add_chains(closed, "_closed", "loop closed");
  report.add("frames_driven", frames, "of the first seed");
  report.add("squared_error_adaptive_px2", adaptive, "summed over all measurements, by frames driven");
  report.add("squared_error_full_px2", full, "full relative solution");
  report.add("squared_error_ceres_px2", ceres, "full Euclidean solution");
  save_plot({"Squared reprojection error, summed, by keyframes driven: a figure eight",
             "keyframes",
             "square pixels",
             false,
             false,
             {{"adaptive relative", frames, adaptive},
              {"full relative", frames, full},
              {"full Euclidean (Ceres)", frames, ceres, true}}},
            options.picture);
}

void run_real(const EuclideanOptions& options, Report& report) {
  if (options.data.empty())
    throw StatusError(
        Status(Reason::INVALID_ARGUMENT, "--data: name the folder with the data sets, or set RELMAP_DATA"));
  report.add("window", options.window, "frames that a new one activates");
  compare_on(read_stereo_factors(options.data + "/bundle_adjustment"), "stereo_factors", options, report);
  compare_on(track_recording(options.data + "/kitti_raw_0926_1405"), "kitti_raw", options, report);
}

}  // namespace relmap::bench
