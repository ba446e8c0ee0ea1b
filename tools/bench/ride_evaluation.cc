#include "tools/bench/ride_evaluation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "client/relaxation.h"
#include "frontend/tracking/stamps.h"
#include "tests/support/drive_evaluation.h"
#include "tools/bench/report.h"
#include "tools/bench/transforms.h"

namespace relmap::bench {

namespace {

constexpr double kLocalMetres = 1;  // metres
constexpr double kInSight = 6;      // metres from where the robot stands in what carries it: it sees that

double metres(const SE3& from, const SE3& to) { return (from.inverse() * to).t.norm(); }

FrameId frame_of(const storage::Graph& graph, std::size_t n) {
  return {graph.sessions().front().number, static_cast<std::uint32_t>(n)};
}

// Whether a ride lies between two keyframes, or touches one of them.
bool rides_to(const RideDrive& drive, std::size_t n) { return drive.riding[n] || drive.riding[n - 1]; }

double local_error(const storage::Graph& graph, const RideDrive& drive, const Transform& T) {
  std::vector<double> errors;
  for (std::size_t n = 0; n < drive.truth.size(); ++n) {
    double way = 0;
    std::size_t m = n;
    while (way < kLocalMetres && m + 1 < drive.truth.size() && !rides_to(drive, m + 1)) {
      way += metres(drive.truth[m], drive.truth[m + 1]);
      ++m;
    }
    if (way < kLocalMetres) continue;
    const auto found = T(frame_of(graph, n), frame_of(graph, m));
    if (found) errors.push_back(1e3 * (found->t - (drive.truth[n].inverse() * drive.truth[m]).t).norm());
  }
  return mean(errors);
}

void judge_front_end(const RideDrive& drive, RideFigures& out) {
  out.keyframes = static_cast<std::uint32_t>(drive.keyframes.size());
  out.pairs = drive.pairs;
  out.lost = drive.lost;
  std::size_t boards = 0;
  for (std::size_t n = 1; n < drive.keyframes.size(); ++n) {
    const Keyframe& keyframe = drive.keyframes[n];
    out.unseen_steps += !is_vision(keyframe.source);
    const double standing = tracking::seconds(keyframe.standing_us);
    if (!rides_to(drive, n)) {
      out.longest_standing_else_s = std::max(out.longest_standing_else_s, standing);
      continue;
    }
    if (boards == 0) boards = n - 1;
    out.standing_s += standing;
    out.longest_standing_s = std::max(out.longest_standing_s, standing);
    if (!drive.riding[n] || !drive.riding[n - 1]) continue;  // it drove, too
    out.carried_m += metres(drive.truth[n - 1], drive.truth[n]);
    out.sensed_m += metres(drive.keyframes[n - 1].T_odom_frame, keyframe.T_odom_frame);
  }
  const SE3 truth = drive.truth[boards].inverse() * drive.truth.back();
  const SE3 odometry = drive.keyframes[boards].T_odom_frame.inverse() * drive.keyframes.back().T_odom_frame;
  out.odometry_error_m = (odometry.t - truth.t).norm();
}

// Where the robot stands from a lift's cabin, and looks into it, it sees the same place on every floor: that moves, and
// a closure is true of it. The pose of each keyframe by the nearest in which it rides; nothing further away.
std::vector<std::optional<SE3>> aboard(const RideDrive& drive) {
  const std::size_t count = drive.truth.size();
  std::vector<std::size_t> before(count, count), behind(count, count);  // the nearest riding
  for (std::size_t n = 0; n < count; ++n) before[n] = drive.riding[n] ? n : n > 0 ? before[n - 1] : count;
  for (std::size_t n = count; n-- > 0;) behind[n] = drive.riding[n] ? n : n + 1 < count ? behind[n + 1] : count;
  std::vector<std::optional<SE3>> result(count);
  for (std::size_t n = 0; n < count; ++n)
    for (const std::size_t rides : {before[n], behind[n]}) {
      if (rides == count) continue;
      const SE3 T = drive.truth[rides].inverse() * drive.truth[n];
      if (T.t.norm() <= kInSight && (!result[n] || T.t.norm() < result[n]->t.norm())) result[n] = T;
    }
  return result;
}

void judge_closures(const storage::Graph& graph, const RideDrive& drive, RideFigures& out) {
  const std::size_t count = drive.keyframes.size();
  const std::vector<std::optional<SE3>> in_cabin = aboard(drive);
  std::vector<double> way(count, 0);
  for (std::size_t n = 1; n < count; ++n) way[n] = way[n - 1] + metres(drive.truth[n - 1], drive.truth[n]);
  const auto first_ride =
      static_cast<std::size_t>(std::find(drive.riding.begin(), drive.riding.end(), 1) - drive.riding.begin());
  std::size_t last_ride = 0;
  for (std::size_t n = 0; n < count; ++n)
    if (drive.riding[n]) last_ride = n;
  double first_m = INFINITY, last_m = -INFINITY;
  for (std::size_t n = 0; n < count; ++n) {
    const auto hot = graph.hot(frame_of(graph, n));
    for (const storage::Edge& edge : hot->edges) {
      out.carried_edges += !edge.carried_by.empty();
      if (edge.kind != storage::EdgeKind::kLoop) continue;
      const std::size_t a = edge.a.index, b = edge.b.index;
      const bool in_force = edge.state == storage::EdgeState::kAccepted;
      const SE3& measured = in_force ? edge.T_ab : edge.prior_T_ab;
      const SE3 odometry = drive.keyframes[a].T_odom_frame.inverse() * drive.keyframes[b].T_odom_frame;
      const bool wrong = testing::is_wrong((drive.truth[a].inverse() * drive.truth[b]).inverse() * measured);
      if (wrong && in_cabin[a] && in_cabin[b] &&
          !testing::is_wrong((in_cabin[a]->inverse() * *in_cabin[b]).inverse() * measured)) {
        out.of_cabin += in_force;
        continue;
      }
      if (in_force) {
        ++(wrong ? out.wrong : out.right);
        out.closed += !wrong && a < first_ride && b > last_ride;
      } else {
        ++(wrong ? out.wrong_refused : out.right_refused)[edge.reason];
        out.wrong_meanwhile +=
            wrong && std::any_of(edge.history.begin(), edge.history.end(), [](const storage::EdgeEvent& event) {
              return event.state == storage::EdgeState::kAccepted;
            });
      }
      if (!testing::is_wrong(odometry.inverse() * measured)) continue;
      ++out.contradicting;
      if (wrong) continue;
      ++out.contradicting_right;
      first_m = std::min(first_m, way[b]);
      last_m = std::max(last_m, way[b]);
    }
  }
  out.contradicting_right_m = std::max(0.0, last_m - first_m);
}

}  // namespace

double local_error_mm(const storage::Graph& graph, const RideDrive& drive) {
  return local_error(graph, drive, relative_map(graph));
}

RideFigures evaluate_ride(const storage::Graph& graph, const RideDrive& drive) {
  RideFigures out;
  judge_front_end(drive, out);
  judge_closures(graph, drive, out);
  std::vector<FrameId> frames;
  for (std::size_t n = 0; n < drive.keyframes.size(); ++n) frames.push_back(frame_of(graph, n));
  out.local_error_mm = local_error_mm(graph, drive);
  out.local_error_pose_graph_mm = local_error(graph, drive, pose_graph(graph, frames, 0));
  out.local_error_pose_graph_robust_mm =
      local_error(graph, drive, pose_graph(graph, frames, client::RelaxationOptions().loop_huber));
  return out;
}

}  // namespace relmap::bench
