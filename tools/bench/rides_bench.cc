// relmap-bench rides: drives on which the robot is carried, through pictures, front-end and map.
#include <cstdio>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tools/bench/ride_evaluation.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

struct RidesOptions {
  std::string ride = "lift-ramp";
  std::uint64_t first_seed = 1;
  int seeds = 1, width = 320;
  bool on_foot = false, list = false;
};

sim::PictureWorldOptions world_of(const RidesOptions& options, std::uint64_t seed) {
  sim::PictureWorldOptions world = sim::ride_options(*sim::ride_of(options.ride), seed, !options.on_foot);
  world.camera = sim::scaled(world.camera, options.width);
  if (const Status status = world.check(); !status.ok()) throw StatusError(status);
  return world;
}

// Lists every closure, to help in the choice of rules.
void list_closures(const storage::Graph& graph, const RideDrive& drive, std::uint64_t seed) {
  const SessionNumber session = graph.sessions().front().number;
  for (std::size_t n = 0; n < drive.keyframes.size(); ++n) {
    const auto hot = graph.hot({session, static_cast<std::uint32_t>(n)});
    for (const storage::Edge& edge : hot->edges) {
      if (edge.kind != storage::EdgeKind::kLoop) continue;
      const SE3 T = drive.truth[edge.a.index].inverse() * drive.truth[edge.b.index];
      const SE3 odometry =
          drive.keyframes[edge.a.index].T_odom_frame.inverse() * drive.keyframes[edge.b.index].T_odom_frame;
      const SE3 error = T.inverse() * edge.prior_T_ab, error_now = T.inverse() * edge.T_ab;
      const storage::Uniqueness& unique = edge.uniqueness;
      std::fprintf(stderr,
                   "seed %llu %u -> %u %s off %.2f m %.1f deg, odometry off %.2f m, inliers %u p %.4f spread %.2f "
                   "alike %u runner-up %u differs %.2f changed %u/%u; support %u, now off %.2f m %.1f deg\n",
                   static_cast<unsigned long long>(seed), edge.b.index, edge.a.index,
                   std::string(reason_name(edge.reason)).c_str(), error.t.norm(), rotation_angle(error.R) * 180 / M_PI,
                   (odometry.inverse() * edge.prior_T_ab).t.norm(), edge.inliers, static_cast<double>(edge.probability),
                   static_cast<double>(edge.spread), unique.alike, unique.runner_up_inliers,
                   static_cast<double>(unique.differs), unique.changed, unique.compared, edge.support,
                   error_now.t.norm(), rotation_angle(error_now.R) * 180 / M_PI);
    }
  }
}

void run(const RidesOptions& options, Report& report) {
  std::map<std::string, std::vector<double>> series;
  double closed = 0, wrong = 0, wrong_meanwhile = 0, right = 0, of_cabin = 0;
  std::map<Reason, std::uint32_t> right_refused, wrong_refused;
  for (int k = 0; k < options.seeds; ++k) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(k);
    const RideDrive drive = drive_ride(world_of(options, seed));
    const auto without = map_ride(drive, false), mapper = map_ride(drive, true);
    const auto graph = mapper->view();
    const RideFigures f = evaluate_ride(*graph, drive);
    if (options.list) list_closures(*graph, drive, seed);
    closed += f.closed > 0;
    wrong += f.wrong;
    wrong_meanwhile += f.wrong_meanwhile;
    right += f.right;
    of_cabin += f.of_cabin;
    for (const auto& [reason, count] : f.right_refused) right_refused[reason] += count;
    for (const auto& [reason, count] : f.wrong_refused) wrong_refused[reason] += count;
    const auto note = [&](const char* key, double value) { series[key].push_back(value); };
    note("keyframes_of_seed", f.keyframes);
    note("lost_pairs_of_seed", f.lost);
    note("unseen_steps_of_seed", f.unseen_steps);
    note("carried_m_of_seed", f.carried_m);
    note("sensed_m_of_seed", f.sensed_m);
    note("standing_s_of_seed", f.standing_s);
    note("longest_standing_s_of_seed", f.longest_standing_s);
    note("longest_standing_else_s_of_seed", f.longest_standing_else_s);
    note("odometry_error_m_of_seed", f.odometry_error_m);
    note("right_of_seed", f.right);
    note("wrong_of_seed", f.wrong);
    note("closed_of_seed", f.closed);
    note("contradicting_of_seed", f.contradicting);
    note("contradicting_right_of_seed", f.contradicting_right);
    note("contradicting_right_m_of_seed", f.contradicting_right_m);
    note("carried_edges_of_seed", f.carried_edges);
    note("local_error_floor_mm_of_seed", local_error_mm(*without->view(), drive));
    note("local_error_mm_of_seed", f.local_error_mm);
    note("local_error_pose_graph_mm_of_seed", f.local_error_pose_graph_mm);
    note("local_error_pose_graph_robust_mm_of_seed", f.local_error_pose_graph_robust_mm);
  }
  report.add("seeds", options.seeds, "drives");
  report.add("rides_closed", closed, "of them, with a right closure from behind the last ride to before the first");
  report.add("closures_right", right, "in force, within 0.5 m and 10 degrees of truth");
  report.add("closures_wrong", wrong, "in force, beyond that");
  report.add("closures_wrong_meanwhile", wrong_meanwhile, "those that were in force, and were taken back");
  report.add("closures_of_cabin", of_cabin, "in force, within that of what carries the robot, which has moved between");
  for (const auto& [reason, count] : right_refused)
    report.add("right_not_in_force_" + std::string(reason_name(reason)), count, "right closures refused so");
  for (const auto& [reason, count] : wrong_refused)
    report.add("wrong_not_in_force_" + std::string(reason_name(reason)), count, "wrong closures refused so");
  const auto mean_of = [&](const char* key) { return mean(series[std::string(key) + "_of_seed"]); };
  report.add("local_error_floor_mm", mean_of("local_error_floor_mm"), "of position over a metre; without closures");
  report.add("local_error_mm", mean_of("local_error_mm"), "the same, with closures");
  report.add("local_error_pose_graph_mm", mean_of("local_error_pose_graph_mm"), "global pose graph of the same edges");
  report.add("local_error_pose_graph_robust_mm", mean_of("local_error_pose_graph_robust_mm"),
             "the same, robust against wrong loops");
  for (auto& [key, values] : series) report.add(key, values, "");
}

}  // namespace

Run declare_rides(CLI::App& app) {
  const auto options = std::make_shared<RidesOptions>();
  app.add_option("--ride", options->ride, "kind of ride, as in relmap-sim pictures --ride")
      ->check(CLI::IsMember({"lift", "lift-alike", "lift-ramp", "train", "escalator", "alike"}))
      ->capture_default_str();
  app.add_flag("--on-foot", options->on_foot,
               "the robot is not carried; it waits where it would board, and drives all the way");
  app.add_option("--seeds", options->seeds, "number of drives")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--first-seed", options->first_seed, "seed of the first drive")->capture_default_str();
  app.add_option("--width", options->width, "width of the pictures, pixels")
      ->check(CLI::Range(160, 2048))
      ->capture_default_str();
  app.add_flag("--list", options->list, "list every closure on standard error");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
