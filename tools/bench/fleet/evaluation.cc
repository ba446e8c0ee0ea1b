#include "tools/bench/fleet/evaluation.h"

#include <algorithm>
#include <limits>

namespace relmap::bench {

namespace {
constexpr double kNever = std::numeric_limits<double>::infinity();
}

std::optional<std::int64_t> RobotDeeds::settled_ns(std::uint64_t sequence) const {
  const auto heard = std::upper_bound(acknowledged_ns.begin(), acknowledged_ns.end(), sequence,
                                      [](std::uint64_t s, const auto& entry) { return s < entry.first; });
  return heard == acknowledged_ns.end() ? std::nullopt : std::optional(heard->second);
}

std::map<std::uint32_t, RobotDeeds> by_robot(const std::vector<Deed>& deeds) {
  std::map<std::uint32_t, RobotDeeds> robots;
  std::map<std::uint32_t, std::uint64_t> of_processes_before, of_process;  // bytes
  for (const Deed& deed : deeds) {
    RobotDeeds& robot = robots[deed.robot];
    switch (deed.kind) {
      case Deed::Kind::kStarted:
        of_processes_before[deed.robot] += of_process[deed.robot];
        robot.sent = std::max(robot.sent, deed.number);
        break;
      case Deed::Kind::kPushed:
        robot.pushed_ns.emplace(deed.number, deed.time_ns);
        robot.sent = std::max(robot.sent, deed.number + 1);
        break;
      case Deed::Kind::kAcknowledged:
        if (deed.number > robot.acknowledged) robot.acknowledged_ns.emplace_back(deed.number, deed.time_ns);
        robot.acknowledged = std::max(robot.acknowledged, deed.number);
        break;
      case Deed::Kind::kRefused:
        robot.refused = deed.number;
        break;
      case Deed::Kind::kGivenUp:
        robot.given_up = deed.number;
        break;
      case Deed::Kind::kEnded:
        robot.sent = std::max(robot.sent, deed.number);
        robot.ended = true;
        break;
    }
    of_process[deed.robot] = deed.sent_bytes;
    robot.part_bytes = of_processes_before[deed.robot] + deed.sent_bytes;
  }
  return robots;
}

std::vector<double> latencies_ms(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t from_ns,
                                 std::int64_t to_ns) {
  std::vector<double> latencies;
  for (const auto& [number, robot] : robots)
    for (const auto& [sequence, pushed] : robot.pushed_ns) {
      if (pushed < from_ns || pushed >= to_ns) continue;
      const auto settled = robot.settled_ns(sequence);
      // An acknowledgement may be heard, and written down, before push() has returned.
      latencies.push_back(settled ? 1e-6 * static_cast<double>(std::max<std::int64_t>(0, *settled - pushed)) : kNever);
    }
  return latencies;
}

std::uint64_t waiting_at(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t at_ns) {
  std::uint64_t waiting = 0;
  for (const auto& [number, robot] : robots)
    for (const auto& [sequence, pushed] : robot.pushed_ns) {
      if (pushed >= at_ns) continue;
      const auto settled = robot.settled_ns(sequence);
      waiting += !settled || *settled >= at_ns;
    }
  return waiting;
}

std::uint64_t pushed_since(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t from_ns) {
  std::uint64_t count = 0;
  for (const auto& [number, robot] : robots)
    for (const auto& [sequence, pushed] : robot.pushed_ns) count += pushed >= from_ns;
  return count;
}

double settled_after_s(const RobotDeeds& robot, std::int64_t at_ns) {
  double last = 0;
  for (const auto& [sequence, pushed] : robot.pushed_ns) {
    if (pushed >= at_ns) break;
    const auto settled = robot.settled_ns(sequence);
    last = std::max(last, settled ? 1e-9 * static_cast<double>(*settled - at_ns) : kNever);
  }
  return last;
}

double settled_after_s(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t at_ns) {
  double last = 0;
  for (const auto& [number, robot] : robots) last = std::max(last, settled_after_s(robot, at_ns));
  return last;
}

MapTally tally_map(client::Client& map, const std::vector<std::pair<FleetRobot, std::uint64_t>>& sent,
                   const FleetRobot& flooder) {
  const std::vector<client::Session> sessions = map.sessions().or_throw();
  MapTally tally;
  std::uint64_t frames = 0;
  for (const client::Session& session : sessions)
    (session.robot == flooder.name() ? tally.flooded : frames) += session.frames;
  for (const auto& [robot, count] : sent)
    for (std::uint32_t sequence = 0; sequence < count; ++sequence) {
      std::uint64_t found = 0;
      for (const client::Session& session : sessions) {
        if (session.robot != robot.name() || session.frames == 0) continue;
        const auto frame = map.frame({session.number, sequence});
        if (!frame.ok() && frame.reason() != Reason::NO_SUCH_FRAME) throw StatusError(frame.status());
        found += frame.ok() && frame->time_us == robot.time_us(sequence);
      }
      found == 0 ? ++tally.missing : ++tally.present;
      if (found > 1) tally.doubled += found - 1;
    }
  tally.strange = frames - tally.present - tally.doubled;
  return tally;
}

}  // namespace relmap::bench
