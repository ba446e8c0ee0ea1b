#include "tests/support/drive_evaluation.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <unordered_map>

#include "storage/graph/binding.h"
#include "storage/graph/path_tree.h"
#include "tools/sim/measures.h"

namespace relmap::testing {

namespace {

constexpr double kWrongMetres = 0.5;
constexpr double kWrongRadians = 10 * M_PI / 180;
constexpr std::uint32_t kBoundObservations = 20;
constexpr std::uint32_t kRevisitEdges = 20;
constexpr std::int64_t kRevisitMicroseconds = 10'000'000;
constexpr std::int64_t kSameInstant = 2'000;  // us

// The keyframes of a session that have truth, in order.
struct Drive {
  std::vector<FrameId> frames;
  std::vector<SE3> truth;
  std::vector<std::int64_t> time_us;
  std::unordered_map<FrameId, std::size_t> index;
  std::uint32_t without_truth = 0;
};

Drive match_truth(const storage::Graph& graph, const storage::Session& session, const DriveTruth& truth) {
  Drive drive;
  for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i) {
    const FrameId id{session.number, i};
    const auto hot = graph.hot(id);
    if (!hot) continue;
    const auto pose = truth_at(truth, hot->time_us - session.first_time_us);
    if (!pose) {
      ++drive.without_truth;
      continue;
    }
    drive.index[id] = drive.frames.size();
    drive.frames.push_back(id);
    drive.truth.push_back(*pose);
    drive.time_us.push_back(hot->time_us);
  }
  return drive;
}

// T_root_frame of every frame of the drive, breadth-first through the whole graph.
std::vector<std::optional<SE3>> unroll(const storage::Graph& graph, const Drive& drive, std::size_t root) {
  constexpr auto kAll = std::numeric_limits<std::uint32_t>::max();
  const storage::PathTree tree = storage::build_path_tree(graph, drive.frames[root], {.depth = kAll, .frames = kAll});
  const std::vector<SE3> poses = storage::poses_along(graph, tree);
  std::vector<std::optional<SE3>> result(drive.frames.size());
  for (std::size_t n = 0; n < tree.nodes.size(); ++n)
    if (const auto found = drive.index.find(tree.nodes[n].frame); found != drive.index.end())
      result[found->second] = poses[n];
  return result;
}

void judge_closures(const storage::Graph& graph, const Drive& drive, DriveEvaluation& result) {
  for (const FrameId frame : drive.frames)
    for (const storage::Edge& edge : graph.hot(frame)->edges) {
      if (edge.kind != storage::EdgeKind::kLoop || edge.state != storage::EdgeState::kAccepted) continue;
      const auto a = drive.index.find(edge.a), b = drive.index.find(edge.b);
      if (a == drive.index.end() || b == drive.index.end()) continue;
      const SE3 error = (drive.truth[a->second].inverse() * drive.truth[b->second]).inverse() * edge.T_ab;
      ++(is_wrong(error) ? result.closures_wrong : result.closures_right);
      result.loop_edges += edge.carries;
    }
}

std::uint32_t count_doubled(const storage::Graph& graph, const storage::Session& session) {
  std::set<std::pair<std::int64_t, std::uint32_t>> seen;  // time and CRC32C of the payload
  std::uint32_t doubled = 0;
  for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i)
    if (const auto hot = graph.hot({session.number, i}))
      doubled += !seen.insert({hot->time_us, hot->payload_crc}).second;
  return doubled;
}

bool is_bound(const storage::Graph& graph, const Drive& drive, std::size_t frame) {
  std::uint32_t old = 0;
  for (const storage::Observation& observation : graph.warm(drive.frames[frame])->observations) {
    if (!storage::closure_holds(graph, observation.origin)) continue;
    const auto base = drive.index.find(storage::resolve(graph, observation.landmark).base);
    if (base == drive.index.end()) continue;
    old += base->second + kRevisitEdges < frame &&
           drive.time_us[base->second] + kRevisitMicroseconds < drive.time_us[frame];
  }
  return old >= kBoundObservations;
}

Status corrupt(const std::string& file, std::size_t line) {
  return {Reason::CORRUPT, file + ", line " + std::to_string(line) + ": not a row of numbers as expected"};
}

}  // namespace

std::optional<SE3> truth_at(const DriveTruth& truth, std::int64_t since_start) {
  const auto at = std::lower_bound(truth.time_us.begin(), truth.time_us.end(), since_start - kSameInstant);
  if (at == truth.time_us.end() || std::abs(*at - since_start) > kSameInstant) return std::nullopt;
  return truth.poses[static_cast<std::size_t>(at - truth.time_us.begin())];
}

bool is_wrong(const SE3& error) { return error.t.norm() > kWrongMetres || rotation_angle(error.R) > kWrongRadians; }

bool is_wrong(const SE3& error, const Matrix6& covariance) {
  const double metres = 3 * std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  const double radians = 3 * std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
  return error.t.norm() > std::max(kWrongMetres, metres) || rotation_angle(error.R) > std::max(kWrongRadians, radians);
}

Result<DriveTruth> read_truth(const std::string& folder) {
  DriveTruth truth;
  std::string file = folder + "/poses.txt";
  std::ifstream poses(file);
  if (!poses) poses.open(file = folder + "/poses_gt.txt");
  if (!poses) return Status(Reason::NO_SUCH_FILE, folder + " has neither poses.txt nor poses_gt.txt");
  std::string line;
  while (std::getline(poses, line)) {
    std::istringstream in(line);
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m;
    for (int i = 0; i < 12; ++i)
      if (!(in >> m.data()[i])) return corrupt(file, truth.poses.size() + 1);
    truth.poses.push_back(SE3{m.leftCols<3>(), m.col(3)}.normalized());
  }
  std::ifstream times(folder + "/times.txt");
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    double seconds = static_cast<double>(i) / 10;
    if (times.is_open() && !(times >> seconds)) return corrupt(folder + "/times.txt", i + 1);
    truth.time_us.push_back(std::llround(seconds * 1e6));
  }
  for (std::size_t i = truth.time_us.size(); i-- > 0;) truth.time_us[i] -= truth.time_us[0];
  return truth;
}

EdgesJudged judge_edges(const storage::Graph& graph, const DriveTruth& truth) {
  EdgesJudged judged;
  const auto truth_of = [&](FrameId frame) -> std::optional<SE3> {
    const auto session = graph.session(frame.session);
    const auto hot = graph.hot(frame);
    return session && hot ? truth_at(truth, hot->time_us - session->first_time_us) : std::nullopt;
  };
  for (const storage::Session& session : graph.sessions())
    for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i) {
      const auto hot = graph.hot({session.number, i});
      for (const storage::Edge& edge : hot ? hot->edges : std::vector<storage::Edge>{}) {
        const auto a = truth_of(edge.a), b = truth_of(edge.b);
        if (edge.state != storage::EdgeState::kAccepted || !a || !b) continue;
        const SE3 error = (a->inverse() * *b).inverse() * edge.T_ab;
        if (edge.kind == storage::EdgeKind::kLoop)
          ++(is_wrong(error) ? judged.wrong : judged.right);
        else
          judged.worst_step_m = std::max(judged.worst_step_m, error.t.norm());
      }
    }
  return judged;
}

DriveEvaluation evaluate_drive(const storage::Graph& graph, SessionNumber number, const DriveTruth& truth) {
  DriveEvaluation result;
  const auto session = graph.session(number);
  if (!session) return result;
  const Drive drive = match_truth(graph, *session, truth);
  result.keyframes = session->frames;
  result.keyframes_doubled = count_doubled(graph, *session);
  result.keyframes_without_truth = drive.without_truth;
  if (drive.frames.empty()) return result;
  judge_closures(graph, drive, result);

  std::vector<std::vector<std::optional<SE3>>> T_root_frame;
  for (std::size_t root = 0; root < drive.frames.size(); ++root) T_root_frame.push_back(unroll(graph, drive, root));
  result.registration_error_m =
      sim::registration_error(drive.truth, [&](std::size_t root) { return T_root_frame[root]; }).mean_m;

  const auto revisits = sim::find_revisits(drive.truth, drive.time_us);
  const auto revisit_error =
      sim::revisit_error(drive.truth, revisits, [&](std::size_t a, std::size_t b) { return T_root_frame[a][b]; });
  result.revisits = static_cast<std::uint32_t>(revisits.size());
  for (const sim::Revisit& revisit : revisits) result.revisits_bound += is_bound(graph, drive, revisit.frame);
  result.revisit_error_m = revisit_error.mean_m;
  result.revisit_error_max_m = revisit_error.max_m;
  result.revisits_disconnected = static_cast<std::uint32_t>(revisit_error.disconnected);
  return result;
}

}  // namespace relmap::testing
