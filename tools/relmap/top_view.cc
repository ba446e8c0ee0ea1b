#include "tools/relmap/top_view.h"

#include <algorithm>
#include <map>
#include <ostream>
#include <set>
#include <string>

#include "tools/relmap/robot_trouble.h"
#include "tools/relmap/status_view.h"

namespace relmap::cli {

namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string seconds_text(double seconds) {
  return seconds < 10 ? fixed(seconds, 2) + " s" : terminal::duration_text(seconds);
}

std::string rate(std::uint64_t now, std::uint64_t before, double seconds) {
  return seconds > 0 && now >= before ? fixed(static_cast<double>(now - before) / seconds, 1) : "-";
}

void print_daemon(const TopMoment& now, const std::optional<TopMoment>& before, terminal::Console& console) {
  const client::DaemonStatus& s = now.status;
  const double seconds = before ? std::chrono::duration<double>(now.at - before->at).count() : 0;
  std::map<client::SessionState, std::size_t> states;
  for (const client::Session& session : now.sessions) ++states[session.state];
  std::string sessions = count_text(s.sessions);
  for (const auto& [state, count] : states) sessions += ", " + count_text(count) + ' ' + name_of(state);
  std::string shares;
  for (const client::MemoryShare& share : s.memory_shares) {
    if (share.used == 0) continue;
    const auto percent = share.allowance ? 100 * share.used / share.allowance : 0;
    shares += (shares.empty() ? "" : ", ") + share.name + ' ' + terminal::bytes_text(share.used) + " (" +
              std::to_string(percent) + " %)";
  }
  console.facts({
      {"daemon", "relmapd " + s.version + ", up " + terminal::duration_text(static_cast<double>(s.uptime_us) * 1e-6) +
                     (s.storage.ok() ? "" : "; takes nothing in: " + s.storage.to_string())},
      {"robots", robots_text(now.robots)},
      {"sessions", sessions},
      {"map", counted_text(s.frames, "frame") + ", " + counted_text(s.closures_accepted, "loop closure") + ", " +
                  counted_text(s.places, "place")},
      {"worker", rate(s.frames, before ? before->status.frames : 0, seconds) + " frames/s; relaxation p50 " +
                     fixed(s.relaxation_p50_us * 1e-3, 1) + " ms, p99 " + fixed(s.relaxation_p99_us * 1e-3, 1) + " ms"},
      {"waiting", waiting_text(s)},
      {"memory", terminal::bar_text(s.memory_used, s.memory_budget) + " " + terminal::bytes_text(s.memory_used) +
                     " of " + terminal::bytes_text(s.memory_budget)},
      {"shares", shares},
  });
}

int rank(const RobotTrouble& trouble) { return trouble.urgent ? 0 : trouble.name.empty() ? 2 : 1; }

void print_robots(std::vector<client::RobotStatus> robots, const std::set<SessionNumber>& frozen, std::size_t max_rows,
                  terminal::Console& console) {
  if (robots.empty()) return;
  std::stable_sort(robots.begin(), robots.end(), [&](const client::RobotStatus& a, const client::RobotStatus& b) {
    return rank(trouble_of(a, frozen)) < rank(trouble_of(b, frozen));
  });
  Rows rows;
  for (const client::RobotStatus& r : robots) {
    if (rows.size() == max_rows) break;
    rows.push_back({robot_name(r), r.session ? std::to_string(r.session) + ' ' + r.name : r.uuid.substr(0, 8),
                    fixed(r.keyframes_per_s, 1), terminal::bytes_text(static_cast<std::uint64_t>(r.bytes_per_s)) + "/s",
                    r.lag_s ? seconds_text(*r.lag_s) : "-", seconds_text(r.silent_s), count_text(r.next_sequence),
                    count_text(r.missing + r.incomplete), count_text(r.pending + r.queued_messages),
                    counts_text(r.refused, "-"), trouble_of(r, frozen).name});
  }
  console.out() << '\n';
  console.table({"robot", "session", ">kf/s", ">received", ">lag", ">silent", ">acknowledged", ">missing", ">queue",
                 "refused", "trouble"},
                rows);
  if (robots.size() > rows.size()) console.out() << "... and " << robots.size() - rows.size() << " more\n";
}

void print_sessions(std::vector<client::Session> sessions, const std::optional<TopMoment>& before, std::size_t max_rows,
                    terminal::Console& console) {
  if (sessions.empty()) return;
  std::map<SessionNumber, std::uint32_t> frames;
  if (before)
    for (const client::Session& session : before->sessions) frames[session.number] = session.frames;
  std::stable_sort(sessions.begin(), sessions.end(),
                   [](const client::Session& a, const client::Session& b) { return a.last_time_us > b.last_time_us; });
  const std::size_t all = sessions.size();
  sessions.resize(std::min(all, max_rows));
  Rows rows;
  for (const client::Session& s : sessions) {
    const std::uint32_t grown = before ? s.frames - std::min(s.frames, frames[s.number]) : 0;
    rows.push_back({std::to_string(s.number), s.name, s.robot, name_of(s.state), count_text(s.frames),
                    grown ? "+" + count_text(grown) : "", count_text(s.refused), count_text(s.given_up),
                    terminal::time_text(s.last_time_us)});
  }
  console.out() << '\n';
  console.table({">no", "session", "robot", "state", ">frames", ">grown", ">refused", ">given up", "newest frame"},
                rows);
  if (all > rows.size()) console.out() << "... and " << all - rows.size() << " more\n";
}

}  // namespace

void print_top(const TopMoment& now, const std::optional<TopMoment>& before, const TopLimits& limits,
               terminal::Console& console) {
  print_daemon(now, before, console);
  print_robots(now.robots, frozen_ones(now.sessions), limits.robots, console);
  print_sessions(now.sessions, before, limits.sessions, console);
}

}  // namespace relmap::cli
