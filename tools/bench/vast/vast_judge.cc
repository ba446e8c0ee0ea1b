#include "tools/bench/vast/vast_judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "server/route/transform.h"
#include "storage/graph/binding.h"
#include "storage/maintenance/verify.h"
#include "storage/map/map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tests/support/drive_evaluation.h"

namespace relmap::bench {

namespace {

constexpr double kSamePlace = 2, kSameWay = 15 * 0.017453292519943295;
constexpr std::uint32_t kLongBefore = 100;  // frames of one robot
constexpr std::uint32_t kBoundObservations = 20;
constexpr std::size_t kMaxTold = 20, kSample = 400;

// The frames that stood in each square of the plane, in the order in which they came into the map.
class Ground {
 public:
  struct Stood {
    FrameId frame;
    float x, z, yaw;
  };

  // An earlier frame that stood where this one does.
  std::optional<FrameId> find(FrameId frame, const sim::PlanePose& pose) const {
    const auto [column, row] = square(pose);
    for (std::int32_t c = column - 1; c <= column + 1; ++c)
      for (std::int32_t r = row - 1; r <= row + 1; ++r)
        if (const auto at = squares_.find(key(c, r)); at != squares_.end())
          for (const Stood& stood : at->second)
            if (is_old(stood.frame, frame) && std::hypot(stood.x - pose.x, stood.z - pose.z) < kSamePlace &&
                std::abs(std::remainder(stood.yaw - pose.yaw, 6.283185307179586)) < kSameWay)
              return stood.frame;
    return std::nullopt;
  }
  void add(FrameId frame, const sim::PlanePose& pose) {
    const auto [column, row] = square(pose);
    squares_[key(column, row)].push_back(
        {frame, static_cast<float>(pose.x), static_cast<float>(pose.z), static_cast<float>(pose.yaw)});
  }

  static bool is_old(FrameId other, FrameId frame) {
    return other.session != frame.session || other.index + kLongBefore < frame.index;
  }

 private:
  static std::pair<std::int32_t, std::int32_t> square(const sim::PlanePose& pose) {
    return {static_cast<std::int32_t>(std::floor(pose.x / kSamePlace)),
            static_cast<std::int32_t>(std::floor(pose.z / kSamePlace))};
  }
  static std::uint64_t key(std::int32_t column, std::int32_t row) {
    return std::uint64_t{static_cast<std::uint32_t>(column)} << 32 | static_cast<std::uint32_t>(row);
  }
  std::unordered_map<std::uint64_t, std::vector<Stood>> squares_;
};

class TownJudge {
 public:
  // The table of the edges and closures is written to `table` unless that is null.
  TownJudge(const VastTown& town, const storage::Graph& graph, std::ostream* table)
      : town_(town), graph_(graph), table_(table) {
    if (table_)
      *table_ << "kind\ta\tb\tapart_m\terror_m\terror_rad\tsigma_m\tsigma_rad\tchi2\tinliers\tspread\tsupport\tbound\t"
                 "carries\tcarried\n";
    for (const storage::Session& session : graph.sessions()) {
      const std::uint32_t robot = town.robot_of(session.header.name);
      if (robot == town.robots()) throw std::runtime_error("a session is of no robot: " + session.header.name);
      robots_.emplace(session.number, std::make_unique<sim::CityRobot>(town.robot(robot)));
    }
  }

  void judge(VastVerdict& verdict) {
    count(verdict);
    std::vector<std::pair<std::uint64_t, FrameId>> order;  // in which they came
    for (const storage::Session& session : graph_.sessions())
      for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i)
        if (const auto hot = graph_.hot({session.number, i})) {
          order.emplace_back(hot->journal_sequence, FrameId{session.number, i});
          judge_edges(*hot, verdict);
        }
    std::sort(order.begin(), order.end());
    Ground ground;
    std::vector<std::pair<FrameId, FrameId>> revisits;
    for (const auto& [sequence, frame] : order) {
      const sim::CityDrive::Standpoint standpoint = robot(frame).drive().at(frame.index);
      if (standpoint.ride != 0) continue;
      if (const auto earlier = ground.find(frame, standpoint.pose)) {
        ++verdict.revisits;
        verdict.revisits_bound += is_bound(frame);
        revisits.emplace_back(*earlier, frame);
        returned_.insert(frame);
      }
      ground.add(frame, standpoint.pose);
    }
    judge_rides(verdict);
    measure(std::move(revisits), verdict);
  }

 private:
  const sim::CityRobot& robot(FrameId frame) const { return *robots_.at(frame.session); }
  SE3 truth(FrameId frame) const { return robot(frame).T_world_frame(frame.index); }

  void count(VastVerdict& verdict) {
    std::vector<bool> seen(town_.robots());
    for (const storage::Session& session : graph_.sessions()) {
      const std::uint32_t number = town_.robot_of(session.header.name);
      verdict.doubled += seen[number] ? session.frames : 0;
      seen[number] = true;
      verdict.keyframes += session.frames;
      verdict.lost += town_.frames(number) - std::min(town_.frames(number), session.frames);
      std::set<std::pair<std::int64_t, std::uint32_t>> payloads;
      for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i)
        if (const auto hot = graph_.hot({session.number, i}))
          verdict.doubled += !payloads.insert({hot->time_us, hot->payload_crc}).second;
      if (session.frames > 0) verdict.metres += robots_.at(session.number)->drive().metres_driven(session.last);
    }
    for (std::uint32_t number = 0; number < town_.robots(); ++number)
      if (!seen[number]) verdict.lost += town_.frames(number);
    verdict.street_metres = town_.world().plan().street_metres();
  }

  void judge_edges(const storage::FrameHot& hot, VastVerdict& verdict) {
    for (const storage::Edge& edge : hot.edges) {
      if (edge.state != storage::EdgeState::kAccepted) continue;
      const SE3 T = truth(edge.a).inverse() * truth(edge.b);
      const SE3 error = T.inverse() * edge.T_ab;
      if (table_) tell(edge, T, error);
      if (edge.kind != storage::EdgeKind::kLoop) {
        if (!edge.carried_by.empty()) carried_.insert(edge.b);
        if (!rode({edge.b.session, edge.a.index, edge.b.index})) {
          verdict.step_error_m.push_back(error.t.norm());
          verdict.own_step_error_m.push_back((T.inverse() * odometry(edge.a).inverse() * odometry(edge.b)).t.norm());
        }
        continue;
      }
      verdict.carried_wrongly += edge.carried.session != 0 && !rode(edge.carried);
      if (!testing::is_wrong(error, edge.covariance)) {
        ++(testing::is_wrong(error) ? verdict.closures_vague : verdict.closures_right);
        continue;
      }
      ++verdict.closures_wrong;
      if (verdict.wrong.size() < kMaxTold)
        verdict.wrong.push_back(edge.a.to_string() + " to " + edge.b.to_string() + ": " +
                                std::to_string(error.t.norm()) + " m off, " + std::to_string(edge.inliers) +
                                " inliers");
    }
  }

  void tell(const storage::Edge& edge, const SE3& T, const SE3& error) {
    const Vector6 off = error.log();
    *table_ << (edge.kind == storage::EdgeKind::kLoop ? "closure" : "motion") << '\t' << edge.a.to_string() << '\t'
            << edge.b.to_string() << '\t' << T.t.norm() << '\t' << error.t.norm() << '\t' << rotation_angle(error.R)
            << '\t' << std::sqrt(edge.covariance.topLeftCorner<3, 3>().trace()) << '\t'
            << std::sqrt(edge.covariance.bottomRightCorner<3, 3>().trace()) << '\t'
            << off.dot(edge.covariance.ldlt().solve(off)) << '\t' << edge.inliers << '\t' << edge.spread << '\t'
            << edge.support << '\t' << edge.bound << '\t' << edge.carries << '\t' << (edge.carried.session != 0)
            << '\n';
  }

  // Whether a train ran somewhere along the stretch.
  bool rode(const storage::FrameRange& stretch) const {
    const sim::CityDrive& drive = robots_.at(stretch.session)->drive();
    for (std::uint32_t i = stretch.first; i <= stretch.last; ++i)
      if (drive.at(i).running) return true;
    return false;
  }

  bool is_bound(FrameId frame) const {
    // Of two robots that drive side by side, either may have begun a landmark that both see.
    const auto is_old = [&](LandmarkId landmark) {
      const auto base = graph_.hot(landmark.base);
      if (!base || landmark.slot >= base->landmarks.size()) return false;
      const auto from_old = [&](FrameId other) { return Ground::is_old(other, frame); };
      return from_old(landmark.base) || std::ranges::any_of(base->landmarks[landmark.slot].observers, from_old);
    };
    std::uint32_t old = 0;
    for (const storage::Observation& observation : graph_.warm(frame)->observations)
      old +=
          storage::closure_holds(graph_, observation.origin) && is_old(storage::resolve(graph_, observation.landmark));
    return old >= kBoundObservations;
  }

  void judge_rides(VastVerdict& verdict) {
    for (const auto& [number, robot] : robots_) {
      const auto session = *graph_.session(number);
      std::map<std::uint32_t, std::array<std::uint32_t, 2>> rides;  // first and last frame while the train ran
      for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i)
        if (const auto at = robot->drive().at(i); at.running) {
          auto& frames = rides.try_emplace(at.ride, std::array{i, i}).first->second;
          frames[1] = i;
        }
      for (auto ride = rides.begin(); ride != rides.end(); ++ride) {
        const std::uint32_t end = std::next(ride) == rides.end() ? session.last : std::next(ride)->second[0];
        ++verdict.rides;
        const auto back = returned_.lower_bound({number, ride->second[1]});
        if (back == returned_.end() || *back >= FrameId{number, end}) continue;
        ++verdict.rides_returned;
        const auto carried = carried_.lower_bound({number, ride->second[0]});
        if (carried != carried_.end() && *carried <= FrameId{number, ride->second[1] + 1})
          ++verdict.rides_closed;
        else
          verdict.unnoticed.push_back("session " + std::to_string(number) + ", frames " +
                                      std::to_string(ride->second[0]) + " to " + std::to_string(ride->second[1]) +
                                      "; a known place was seen in frame " + std::to_string(back->index));
      }
    }
  }

  void measure(std::vector<std::pair<FrameId, FrameId>> revisits, VastVerdict& verdict) {
    std::mt19937_64 random(1);
    std::shuffle(revisits.begin(), revisits.end(), random);
    revisits.resize(std::min(revisits.size(), kSample));
    for (const auto& [earlier, frame] : revisits) {
      const SE3 T = truth(earlier).inverse() * truth(frame);
      if (earlier.session == frame.session) {
        const SE3 by_odometry = odometry(earlier).inverse() * odometry(frame);
        verdict.odometry_error_m.push_back((by_odometry.t - T.t).norm());
      }
      const auto through = route::transform_between(graph_, earlier, frame);
      if (through.ok())
        verdict.map_error_m.push_back((through->T_ab.t - T.t).norm());
      else
        ++verdict.disconnected;
    }
  }
  SE3 odometry(FrameId frame) const { return graph_.hot(frame)->T_odom_frame; }

  const VastTown& town_;
  const storage::Graph& graph_;
  std::ostream* table_;
  std::map<SessionNumber, std::unique_ptr<const sim::CityRobot>> robots_;
  std::set<FrameId> returned_, carried_;
};

// What is unsound in the map and its journal; the first findings are told.
std::uint64_t verify(const storage::Engine& engine) {
  std::size_t told = 0;
  const auto tell = [&](const storage::Finding& finding) {
    if (++told <= kMaxTold)
      std::cerr << "verify: " << reason_name(finding.reason) << ' ' << finding.frame.to_string() << ' ' << finding.what
                << '\n';
  };
  return storage::verify(*engine.snapshot(), {}, tell, {}).or_throw().findings +
         storage::verify_journal(engine, tell, {}).or_throw().findings;
}

std::uint64_t bytes_in(const std::string& folder) {
  std::uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

}  // namespace

VastVerdict judge_town(const VastTown& town, const VastOptions& options) {
  const std::string folder = options.folder + "/map";
  VastVerdict verdict;
  verdict.bytes_on_disk = bytes_in(folder);
  const auto engine = storage::open_rocksdb(folder, {}).or_throw();
  verdict.findings = verify(*engine);
  const std::uint64_t epoch = engine->acquire().or_throw();
  const auto map =
      storage::Map::open(engine, epoch, std::make_shared<storage::Budget>(options.memory_budget_mb << 20)).or_throw();
  std::ofstream table;
  if (!options.edges.empty()) table.open(options.edges);
  TownJudge(town, *map->publish(), table.is_open() ? &table : nullptr).judge(verdict);
  if (!options.edges.empty() && !table.flush()) throw std::runtime_error("cannot write " + options.edges);
  return verdict;
}

}  // namespace relmap::bench
