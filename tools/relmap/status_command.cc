#include <ostream>

#include "tools/relmap/commands.h"

namespace relmap::cli {

namespace {

std::string counts_text(const client::ReasonCounts& counts) {
  std::string text;
  for (const auto& [reason, count] : counts)
    text += (text.empty() ? "" : ", ") + std::string(reason_name(reason)) + ' ' + std::to_string(count);
  return text.empty() ? "none" : text;
}

std::string milliseconds(double us) { return fixed(us / 1000, 2) + " ms"; }

void print_memory(const client::DaemonStatus& s, Console& console) {
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](const std::string& name, std::uint64_t used, std::uint64_t allowance) {
    rows.push_back({name, bytes_text(used), bytes_text(allowance), bar_text(used, allowance)});
  };
  row("whole budget", s.memory_used, s.memory_budget);
  for (const client::MemoryShare& share : s.memory_shares) row("  " + share.name, share.used, share.allowance);
  console.table({"memory", ">used", ">allowed", ""}, rows);
}

void print(const client::DaemonStatus& s, Console& console) {
  const auto n = [](auto value) { return std::to_string(value); };
  console.facts({
      {"daemon", "relmapd " + s.version + ", process " + n(s.pid) + ", up " +
                     duration_text(static_cast<double>(s.uptime_us) * 1e-6) +
                     (s.deterministic ? ", deterministic" : "")},
      {"data", s.data_folder},
      {"storage", s.storage.to_string()},
      {"lcm", s.lcm.ok() ? (s.lcm_url.empty() ? "off" : s.lcm_url) : s.lcm.to_string()},
      {"map",
       n(s.sessions) + " sessions, " + n(s.frames) + " frames, " + n(s.labels) + " labels, " + n(s.places) + " places" +
           (s.places_left_out ? " (" + n(s.places_left_out) + " more found no room: none will be recognised there)"
                              : "")},
      {"loop closures", n(s.closures_accepted) + " accepted, " + n(s.closures_candidate) + " candidates, " +
                            n(s.closures_quarantined) + " quarantined, " + n(s.closures_removed) + " removed"},
      {"routes", s.routes_missing_because.empty()
                     ? "by cells of " + n(s.route_chunks) + " chunks, for " + n(s.route_weights) + " kinds of cost; " +
                           n(s.route_chunks_changed) + " changed since, " + n(s.route_cells_outdated) + " outdated"
                     : "frame by frame: " + s.routes_missing_because},
      {"refused", s.refused ? n(s.refused) + ": " + counts_text(s.refused_by_reason) : "none"},
      {"given up", n(s.gaps)},
      {"received", n(s.ingest_keyframes) + " keyframes, " + n(s.ingest_repeats) + " repeats, " +
                       n(s.ingest_parts_corrupt) + " corrupt parts, from " + n(s.robots) + " robots"},
      {"not taken", counts_text(s.not_taken)},
      {"journal", "durable through " + n(s.durable_sequence) + ", applied through " + n(s.applied_sequence)},
      {"waiting", n(s.queued) + " records, " + n(s.lookup_lag) + " lookups, " + n(s.pending_frames) + " relaxations"},
      {"relaxation", "p50 " + milliseconds(s.relaxation_p50_us) + ", p99 " + milliseconds(s.relaxation_p99_us) +
                         ", max " + milliseconds(s.relaxation_max_us) + "; " + fixed(s.active_frames_mean, 1) +
                         " frames active; " + n(s.numerical_failures) + " failures in " + n(s.solves) + " solves"},
      {"resident", bytes_text(s.resident_bytes) + ", at most " + bytes_text(s.resident_max_bytes)},
      {"vocabulary", n(s.vocabulary_words) + " words: " + s.vocabulary_source},
  });
  console.out() << '\n';
  print_memory(s, console);
}

}  // namespace

void add_status(CLI::App& app, Action& action) {
  app.add_subcommand("status", "how the daemon and its map are")->callback([&action] {
    action = [](client::Client& client, Console& console) -> Status {
      const auto status = client.status();
      if (!status.ok()) return status.status();
      if (!console.json) print(*status, console);
      return {};
    };
  });
}

void add_wait(CLI::App& app, Action& action) {
  app.add_subcommand("wait", "until all that came in is applied, looked up and relaxed")->callback([&action] {
    action = [](client::Client& client, Console&) { return client.wait_idle(); };
  });
}

}  // namespace relmap::cli
