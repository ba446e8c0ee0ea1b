#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/relaxation.h"
#include "tests/support/simulated_drive.h"
#include "tools/bench/plot.h"
#include "tools/bench/rba_scenarios.h"
#include "tools/bench/recorded_drive.h"
#include "tools/bench/transforms.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kRideLap = 300;     // frames of 0.2 m
constexpr std::uint32_t kAfterReturn = 40;  // driven on behind the closing
constexpr std::uint32_t kInCabin = 12;      // frames
constexpr std::int64_t kDrivenFrameUs = 200'000;
constexpr std::int64_t kCabinFrameUs = 2'000'000;  // the robot stands, and little changes
constexpr double kStanding = 0.05;                 // metres a second: slower is standing (docs/method.md, 1)
constexpr std::uint32_t kLocalFrames = 5;          // frames: a metre

// Frames [first, end) of a world.
struct Stretch {
  const sim::PointsWorld* world;
  std::uint32_t first, end;
};

struct Place {
  const sim::PointsWorld* world;
  std::uint32_t frame;
};

// Stretches of worlds driven one after another; at the seams the robot senses that it stands still.
class Ride {
 public:
  explicit Ride(const std::vector<Stretch>& stretches) {
    SE3 odometry;
    for (const Stretch& stretch : stretches)
      for (std::uint32_t i = stretch.first; i < stretch.end; ++i) {
        Keyframe keyframe = stretch.world->keyframe(i);
        if (i > stretch.first)
          odometry = (odometry * (stretch.world->T_odom_frame(i - 1).inverse() * keyframe.T_odom_frame)).normalized();
        else if (!keyframes_.empty())
          seam(stretch, keyframe);
        keyframe.session = keyframes_.empty() ? keyframe.session : keyframes_.front().session;
        keyframe.sequence = static_cast<std::uint32_t>(keyframes_.size());
        if (!keyframes_.empty()) set_times(stretch, keyframes_.back(), odometry, keyframe);
        keyframe.T_odom_frame = odometry;
        rename_tracks(stretch, keyframe);
        keyframes_.push_back(std::move(keyframe));
        places_.push_back({stretch.world, i});
      }
  }

  const std::vector<Keyframe>& keyframes() const { return keyframes_; }
  const Place& place(std::uint32_t n) const { return places_[n]; }
  // The true transform between two frames, also across a seam.
  SE3 truth(std::uint32_t n, std::uint32_t m) const {
    return places_[n].world->T_world_frame(places_[n].frame).inverse() *
           places_[m].world->T_world_frame(places_[m].frame);
  }
  bool continuous(std::uint32_t n, std::uint32_t m) const {
    return places_[n].world == places_[m].world && places_[m].frame - places_[n].frame == m - n;
  }

 private:
  // A step at a seam: the robot reports a measured step of zero.
  static void seam(const Stretch& stretch, Keyframe& keyframe) {
    const sim::PointsWorldOptions& world = stretch.world->options();
    keyframe.source = MotionSource::kVision;
    keyframe.step_covariance.setZero();
    keyframe.step_covariance.diagonal().head<3>().setConstant(world.step_noise_m * world.step_noise_m);
    keyframe.step_covariance.diagonal().tail<3>().setConstant(world.step_noise_rad * world.step_noise_rad);
  }
  // Driven or standing, as a front-end would say by its own odometry.
  static void set_times(const Stretch& stretch, const Keyframe& before, const SE3& odometry, Keyframe& keyframe) {
    const bool aboard = stretch.world->options().step < kStanding;
    const std::int64_t step_us = aboard ? kCabinFrameUs : kDrivenFrameUs;
    const double metres = (before.T_odom_frame.inverse() * odometry).t.norm();
    const bool stands = metres < kStanding * 1e-6 * static_cast<double>(step_us);
    keyframe.time_us = before.time_us + step_us;
    keyframe.driven_us = stands ? 0 : step_us;
    keyframe.standing_us = stands ? step_us : 0;
  }
  void rename_tracks(const Stretch& stretch, Keyframe& keyframe) {
    for (std::size_t k = 0; k < keyframe.tracks.size(); ++k) {
      TrackId& id = keyframe.tracks[k].track;
      const TrackId fresh{keyframe.sequence, static_cast<std::uint32_t>(k)};
      id = tracks_.try_emplace({&stretch, id}, fresh).first->second;
    }
  }

  std::map<std::pair<const Stretch*, TrackId>, TrackId> tracks_;
  std::vector<Keyframe> keyframes_;
  std::vector<Place> places_;
};

// What a lookup finds in pictures: old landmarks, measured in the new one as exactly as by tracking, where the tracks
// are not needed then (server/place/reobserve.h).
storage::ClosureProposalRecord measured_again(const storage::ClosureProposalRecord& proposal,
                                              const Keyframe& keyframe) {
  storage::ClosureProposalRecord result = proposal;
  result.bindings.clear();
  for (const storage::ProposedBinding& binding : proposal.bindings) {
    const TrackMeasurement& seen = keyframe.tracks[static_cast<std::size_t>(binding.track)];
    result.bindings.push_back({binding.landmark, -1, seen.u_left, seen.v, seen.u_right, seen.level, true});
    result.bindings.push_back({{}, binding.track});
  }
  return result;
}

// Closures of the last frames with those one lap before, where both are of `world`.
void close_loop(RecordedDrive& drive, const Ride& ride, const sim::PointsWorld& world, std::uint32_t n) {
  const Place& now = ride.place(n);
  if (now.world != &world || now.frame < kRideLap) return;
  const std::uint32_t match = now.frame - kRideLap;  // the first stretch begins at frame 0
  const auto proposal = testing::simulated_closure(drive.map(), world, now.frame, RecordedDrive::frame(n), match,
                                                   RecordedDrive::frame(match));
  if (proposal) drive.propose(measured_again(*proposal, ride.keyframes()[n]));
}

std::unique_ptr<RecordedDrive> driven(const Ride& ride, const sim::PointsWorld& world, std::uint32_t window,
                                      bool closures) {
  rba::RbaOptions rba;
  rba.window = window;
  auto drive = std::make_unique<RecordedDrive>(rba);
  for (std::uint32_t n = 0; n < ride.keyframes().size(); ++n) {
    drive->add(ride.keyframes()[n]);
    if (closures) close_loop(*drive, ride, world, n);
  }
  return drive;
}

// Errors of position over each metre that was driven without a seam, by its first frame; NaN: there is none.
std::vector<double> errors_by_frame(const Ride& ride, const Transform& T) {
  std::vector<double> errors(ride.keyframes().size(), NAN);
  for (std::uint32_t n = 0; n + kLocalFrames < errors.size(); ++n)
    if (ride.continuous(n, n + kLocalFrames))
      errors[n] =
          (T(RecordedDrive::frame(n), RecordedDrive::frame(n + kLocalFrames))->t - ride.truth(n, n + kLocalFrames).t)
              .norm();
  return errors;
}
std::vector<double> local_errors(const Ride& ride, const Transform& T) {
  std::vector<double> errors = errors_by_frame(ride, T);
  std::erase_if(errors, [](double error) { return std::isnan(error); });
  return errors;
}

// Mean error of position of the frames after the closure, relative to those one lap before.
double revisit_error(const Ride& ride, const sim::PointsWorld& world, const Transform& T) {
  double sum = 0;
  std::uint32_t count = 0;
  for (std::uint32_t n = 0; n < ride.keyframes().size(); ++n) {
    if (ride.place(n).world != &world || ride.place(n).frame < kRideLap + kLocalFrames) continue;
    const std::uint32_t match = ride.place(n).frame - kRideLap;
    const auto found = T(RecordedDrive::frame(match), RecordedDrive::frame(n));
    if (!found) continue;
    sum += (found->t - ride.truth(match, n).t).norm();
    ++count;
  }
  return count == 0 ? NAN : sum / count;
}

std::vector<FrameId> frames_of(const RecordedDrive& drive) {
  std::vector<FrameId> frames;
  for (std::uint32_t n = 0; n < drive.driven(); ++n) frames.push_back(RecordedDrive::frame(n));
  return frames;
}

struct Errors {
  double local = 0, revisit = 0;  // metres, sums over seeds
  void add(const Ride& ride, const sim::PointsWorld& world, const Transform& T) {
    local += mean(local_errors(ride, T));
    revisit += revisit_error(ride, world, T);
  }
};

// Boards where `leaves` ends, alights at `arrives`, and drives on until the start has been seen again.
void ride_and_return(const std::string& name, const sim::PointsWorldOptions& world_options, std::uint32_t leaves,
                     std::uint32_t arrives, const LiftOptions& options, const std::string& picture, Report& report) {
  Errors adaptive, full, spread, robust;
  double floor = 0;
  double ridden = 0;
  for (int seed = 1; seed <= options.seeds; ++seed) {
    sim::PointsWorldOptions outside = world_options, inside;
    outside.noise_seed = inside.noise_seed = static_cast<std::uint64_t>(seed);
    inside.world_seed = 77;
    inside.step = 0.01;
    inside.depth_max = 3;
    inside.frames = inside.frames_per_lap = kInCabin;
    const sim::PointsWorld world(outside), cabin(inside);
    const Ride ride({{&world, 0, leaves}, {&cabin, 0, kInCabin}, {&world, arrives, kRideLap + kAfterReturn}});
    ridden = (world.T_world_frame(arrives).t - world.T_world_frame(leaves - 1).t).norm();

    const auto without = driven(ride, world, options.window, false);
    floor += mean(local_errors(ride, relative_map(without->map())));
    const auto drive = driven(ride, world, options.window, true);
    adaptive.add(ride, world, relative_map(drive->map()));
    const Transform global = pose_graph(drive->map(), frames_of(*drive), 0);
    spread.add(ride, world, global);
    robust.add(ride, world, pose_graph(drive->map(), frames_of(*drive), client::RelaxationOptions().loop_huber));
    if (seed == 1)
      save_plot({"Error of position over a metre, by keyframe: a train boarded at keyframe " + std::to_string(leaves),
                 "keyframe",
                 "metres",
                 false,
                 true,
                 {curve_by_step("relative", errors_by_frame(ride, relative_map(drive->map()))),
                  curve_by_step("global pose graph", errors_by_frame(ride, global))}},
                picture);
    drive->relax_fully();
    full.add(ride, world, relative_map(drive->map()));
  }
  const double seeds = options.seeds;
  const auto mm = [&](double metres) { return 1e3 * metres / seeds; };
  report.add(name + "_unsensed_m", ridden, "ridden while the cabin was seen to stand still");
  report.add(name + "_local_error_floor_mm", mm(floor), "of position over a metre, mean; no loop closed");
  report.add(name + "_local_error_mm", mm(adaptive.local), "relative, loop closed, as the map grew");
  report.add(name + "_local_error_full_mm", mm(full.local), "full relative solution");
  report.add(name + "_local_error_pose_graph_mm", mm(spread.local), "global pose graph of the same edges");
  report.add(name + "_local_error_pose_graph_robust_mm", mm(robust.local), "the same, robust against wrong loops");
  report.add(name + "_revisit_error_mm", mm(adaptive.revisit),
             "behind the closing, seen from one lap before; relative");
  report.add(name + "_revisit_error_full_mm", mm(full.revisit), "");
  report.add(name + "_revisit_error_pose_graph_mm", mm(spread.revisit), "");
  report.add(name + "_revisit_error_pose_graph_robust_mm", mm(robust.revisit), "");
}

}  // namespace

void run_lift(const LiftOptions& options, Report& report) {
  report.add("seeds", options.seeds, "");
  report.add("window", options.window, "frames that a new one activates");
  sim::PointsWorldOptions world;
  world.frames_per_lap = kRideLap;
  world.frames = kRideLap + kAfterReturn;
  // A sixth of the circuit by train.
  ride_and_return("train", world, kRideLap / 2, kRideLap / 2 + kRideLap / 6, options, options.picture, report);
  // Round a spiral ramp, and down again by lift.
  world.climb = 4;
  ride_and_return("lift", world, kRideLap, kRideLap, options, "", report);
}

}  // namespace relmap::bench
