#include "tools/relmap/status_view.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <ostream>

#include "tools/relmap/robot_trouble.h"
#include "tools/terminal/advice.h"

namespace relmap::cli {

namespace {

using Facts = std::vector<std::pair<std::string, std::string>>;

constexpr std::size_t kMaxRobots = 4;      // robots named one by one
constexpr std::uint64_t kNearlyFull = 95;  // per cent of a memory share

std::string milliseconds(double us) { return fixed(us / 1000, 2) + " ms"; }

// The memory shares which hold somebody back when they are full, and what is then noticed.
const std::map<std::string, const char*>& felt_when_full() {
  static const std::map<std::string, const char*> shares{{"queues", "robots are told to wait"},
                                                         {"reassembly", "robots are told to wait"},
                                                         {"replies", "callers are refused"},
                                                         {"views", "long exports may be cut off (VIEW_EXPIRED)"},
                                                         {"sessions", "new sessions are refused"}};
  return shares;
}

void add_memory(const client::DaemonStatus& s, Facts& facts) {
  for (const client::MemoryShare& share : s.memory_shares) {
    const auto felt = felt_when_full().find(share.name);
    if (felt == felt_when_full().end() || share.allowance == 0) continue;
    if (100 * share.used < kNearlyFull * share.allowance) continue;
    facts.emplace_back("memory", share.name + " hold " + terminal::bytes_text(share.used) + " of " +
                                     terminal::bytes_text(share.allowance) + ": " + felt->second);
  }
}

void add_robots(const StatusMoment& now, bool urgent, Facts& facts) {
  std::size_t troubled = 0;
  for (const client::RobotStatus& robot : now.robots) {
    const RobotTrouble trouble = trouble_of(robot, now.frozen);
    if (trouble.name.empty() || trouble.urgent != urgent || ++troubled > kMaxRobots) continue;
    facts.emplace_back(robot_words(robot), trouble.name + ": " + trouble.what);
  }
  if (troubled > kMaxRobots)
    facts.emplace_back("robots", std::to_string(troubled - kMaxRobots) + " more " + (urgent ? "in trouble" : "silent") +
                                     ": relmap top names them");
}

std::string routes_text(const client::DaemonStatus& s) {
  if (!s.routes_missing_because.empty()) return "frame by frame: " + s.routes_missing_because;
  return "by cells of " + counted_text(s.route_chunks, "chunk") + ", for " + count_text(s.route_weights) +
         " kinds of cost; " + count_text(s.route_chunks_changed) + " changed since, " +
         count_text(s.route_cells_outdated) + " outdated";
}

// The first sentence of the source, without its origin and licence.
std::string name_of_vocabulary(const std::string& source) {
  return source.substr(0, std::min(source.find(". "), source.find(';')));
}

void print_shares(const client::DaemonStatus& s, terminal::Console& console) {
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](const std::string& name, std::uint64_t used, std::uint64_t allowance) {
    rows.push_back(
        {name, terminal::bytes_text(used), terminal::bytes_text(allowance), terminal::bar_text(used, allowance)});
  };
  row("whole budget", s.memory_used, s.memory_budget);
  for (const client::MemoryShare& share : s.memory_shares) row("  " + share.name, share.used, share.allowance);
  console.out() << '\n';
  console.table({"memory", ">used", ">allowed", ""}, rows);
}

std::string doubt_text(const client::DoubtfulCamera& camera) {
  std::string others;
  for (const SessionNumber session : camera.against) others += (others.empty() ? "" : ", ") + std::to_string(session);
  return camera.robot + ", " + camera.name +
         ": its camera's calibration is in doubt: " + counted_text(camera.contradicted, "keyframe") +
         " contradict it (against sessions " + others + "), and these make no closures. The last: " + camera.message +
         ". Calibrate the camera, and take the drive in again";
}

// Where to read what to do about what needs attention.
std::string advice_text(const client::DaemonStatus& status, const Facts& trouble) {
  std::vector<Reason> reasons;
  for (const auto& [where, what] : trouble)
    for (const Reason reason : terminal::operational_in(what)) reasons.push_back(reason);
  if (!status.doubtful_cameras.empty()) reasons.push_back(Reason::WRONG_CALIBRATION);
  return terminal::advice_on(reasons);
}

}  // namespace

std::string waiting_text(const client::DaemonStatus& s) {
  constexpr double kNoticed = 1;  // seconds
  return counted_text(s.queued, "record") + ", " + counted_text(s.lookup_lag, "place lookup") +
         (s.lookup_lag_s >= kNoticed ? " (" + fixed(s.lookup_lag_s, 0) + " s behind)" : "") + ", " +
         counted_text(s.pending_frames, "relaxation");
}

Facts needs_attention(const StatusMoment& now) {
  const client::DaemonStatus& s = now.status;
  Facts facts;
  if (!s.storage.ok()) facts.emplace_back("storage", s.storage.to_string());
  for (const auto& [name, state] : s.components)
    if (!state.ok() && state.to_string() != s.storage.to_string() && state.to_string() != s.lcm.to_string())
      facts.emplace_back(name, state.to_string());
  if (s.clock_steps > 0)
    facts.emplace_back("clock", "it was set " + std::string(s.clock_step_s > 0 ? "forward" : "back") + " by " +
                                    terminal::duration_text(std::abs(s.clock_step_s)) + ", " +
                                    counted_text(s.clock_steps, "time") +
                                    " since the start: times of keyframes jump as much");
  if (!s.lcm.ok()) facts.emplace_back("lcm", s.lcm.to_string());
  if (!s.connections.ok()) facts.emplace_back("connections", s.connections.to_string());
  if (!s.access.ok()) facts.emplace_back("access list", "it stays as it was: " + s.access.to_string());
  if (!s.certificate.ok()) facts.emplace_back("certificate", s.certificate.to_string());
  add_robots(now, true, facts);
  for (const client::DoubtfulCamera& camera : s.doubtful_cameras)
    facts.emplace_back("session " + std::to_string(camera.session), doubt_text(camera));
  if (s.places_left_out > 0)
    facts.emplace_back("places", count_text(s.places_left_out) +
                                     " frames have no room in the place index: their places are not recognised");
  add_memory(s, facts);
  add_robots(now, false, facts);
  return facts;
}

void print_status(const StatusMoment& now, bool all, terminal::Console& console) {
  const client::DaemonStatus& s = now.status;
  const auto n = [](std::uint64_t value) { return count_text(value); };
  const Facts trouble = needs_attention(now);
  if (trouble.empty()) {
    console.out() << "nothing needs attention\n\n";
  } else {
    console.out() << "needs attention\n";
    Facts indented;
    for (const auto& [where, what] : trouble) indented.emplace_back("  " + where, what);
    console.facts(indented);
    if (const std::string advice = advice_text(now.status, trouble); !advice.empty()) console.out() << advice << '\n';
    console.out() << '\n';
  }
  Facts facts{
      {"daemon", "relmapd " + s.version + (s.commit.empty() ? "" : " (" + s.commit + ")") + ", process " +
                     std::to_string(s.pid) + ", up " +
                     terminal::duration_text(static_cast<double>(s.uptime_us) * 1e-6) +
                     (s.deterministic ? ", deterministic" : "")},
      {"data", s.data_folder},
      {"log level", s.log_level},
      {"you", s.caller_role.empty() ? "not told by this daemon" : s.caller_name + ", " + s.caller_role},
      {"storage", s.storage.ok() ? "OK" : std::string(reason_name(s.storage.reason())) + ", see above"},
      {"lcm",
       s.lcm.ok() ? (s.lcm_url.empty() ? "off" : s.lcm_url) : std::string(reason_name(s.lcm.reason())) + ", see above"},
      {"map", counted_text(s.sessions, "session") + ", " + counted_text(s.frames, "frame") + ", " +
                  counted_text(s.labels, "label") + ", " + counted_text(s.places, "place")},
      {"loop closures", n(s.closures_accepted) + " accepted, " + counted_text(s.closures_candidate, "candidate") +
                            ", " + n(s.closures_quarantined) + " quarantined, " + n(s.closures_removed) + " removed"},
      {"robots", robots_text(now.robots)},
      {"received", counted_text(s.ingest_keyframes, "keyframe") + ", " + counted_text(s.ingest_repeats, "repeat") +
                       ", " + counted_text(s.ingest_parts_corrupt, "corrupt part")},
      {"refused", s.refused ? n(s.refused) + ": " + counts_text(s.refused_by_reason, "none") : "none"},
      {"given up", s.gaps ? counted_text(s.gaps, "keyframe") : "none"},
      {"not taken", counts_text(s.not_taken, "none")},
      {"waiting", waiting_text(s)},
      {"relaxation", "p50 " + milliseconds(s.relaxation_p50_us) + ", p99 " + milliseconds(s.relaxation_p99_us) +
                         ", max " + milliseconds(s.relaxation_max_us)},
      {"routes", routes_text(s)},
      {"memory", terminal::bar_text(s.memory_used, s.memory_budget) + " " + terminal::bytes_text(s.memory_used) +
                     " of " + terminal::bytes_text(s.memory_budget) + "; resident " +
                     terminal::bytes_text(s.resident_bytes) + ", at most " +
                     terminal::bytes_text(s.resident_max_bytes)},
      {"vocabulary",
       n(s.vocabulary_words) + " words: " + (all ? s.vocabulary_source : name_of_vocabulary(s.vocabulary_source))}};
  if (all) {
    facts.emplace_back("journal",
                       "durable through " + n(s.durable_sequence) + ", applied through " + n(s.applied_sequence));
    facts.emplace_back("solves", n(s.solves) + ", " + fixed(s.active_frames_mean, 1) + " frames active in each; " +
                                     n(s.numerical_failures) + " failures, which left the map as it was");
  }
  console.facts(facts);
  if (all) print_shares(s, console);
}

}  // namespace relmap::cli
