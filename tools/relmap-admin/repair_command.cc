#include <memory>

#include "storage/rocksdb/repair_folder.h"
#include "tools/relmap-admin/findings.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

std::string text(const storage::FrameRange& range) {
  const std::string first = std::to_string(range.session) + ":" + std::to_string(range.first);
  return range.first == range.last ? first : first + ".." + std::to_string(range.last);
}
std::string text(const storage::RecordRange& range) {
  const std::string first = std::to_string(range.first);
  return range.first == range.last ? first : first + ".." + std::to_string(range.last);
}
std::string text(SessionNumber context) { return std::to_string(context); }

template <typename Item>
std::string list(const std::vector<Item>& items) {
  std::string all;
  for (const Item& item : items) all += (all.empty() ? "" : ", ") + text(item);
  return all.empty() ? "none" : all;
}
template <typename Item>
std::vector<Json> documents(const std::vector<Item>& items) {
  std::vector<Json> all;
  for (const Item& item : items) all.push_back(Json().add("range", text(item)));
  return all;
}

bool lost(const storage::RepairSummary& s) {
  return !s.lost_sessions.empty() || !s.lost_frames.empty() || !s.lost_records.empty() ||
         s.frames_without_observations + s.frames_without_appearance + s.dropped_observations + s.dropped_claims +
                 s.quarantined_edges >
             0;
}

void print(const storage::RepairSummary& s, const Context& context) {
  context.bar.end();
  if (context.console.json) return;
  if (!s.changed) return context.say("the map is sound; nothing is changed");
  const auto n = [](std::uint64_t value) { return count_text(value); };
  context.console.facts({
      {"lost sessions", list(s.lost_sessions)},
      {"lost frames", list(s.lost_frames)},
      {"lost journal records", list(s.lost_records)},
      {"frames that lost", n(s.frames_without_observations) + " observations, " + n(s.frames_without_appearance) +
                               " appearance, " + n(s.frames_without_words) +
                               " words (recomputed when the daemon starts)"},
      {"dropped",
       n(s.dropped_observations) + " observations and " + n(s.dropped_claims) + " claims of landmarks that are gone"},
      {"closures quarantined", n(s.quarantined_edges)},
      {"bridges over lost frames", n(s.bridges)},
      {"rebuilt", n(s.rebuilt) + " derived items"},
      {"kept aside", s.quarantine.empty() ? "nothing" : s.quarantine + " (yours to delete)"},
      {"still wrong", s.remaining == 0 ? "nothing" : n(s.remaining) + " findings; see verify"},
  });
}

Answer repair_map(const std::string& directory, Context& context) {
  if (!context.server.empty())
    return {Status(Reason::FOLDER_LOCKED,
                   "a map can be repaired only while no daemon owns it: stop the "
                   "daemon, and run "
                   "`relmap-admin repair DIR` on its machine"),
            false,
            {}};
  if (directory.empty()) throw CLI::ValidationError("no map is named: give DIR");
  if (Status free = check_free(directory); !free.ok()) return {free, false, {}};
  const auto done = storage::repair_folder(
      directory, {}, [&](const storage::Finding& finding) { print_finding(context, finding); },
      maintenance_progress(context));
  if (!done.ok()) return {done.status(), done.reason() == Reason::DATA_LOSS, {}};
  if (Status stopped = check_interrupt(); !stopped.ok()) return {stopped, false, {}};
  print(*done, context);
  Answer answer;
  answer.damage = lost(*done) || done->remaining > 0;
  answer.json.add("changed", done->changed)
      .add("salvaged", done->salvaged)
      .add("quarantine", done->quarantine)
      .add("lost_sessions", documents(done->lost_sessions))
      .add("lost_frames", documents(done->lost_frames))
      .add("lost_records", documents(done->lost_records))
      .add("frames_without_observations", done->frames_without_observations)
      .add("frames_without_appearance", done->frames_without_appearance)
      .add("frames_without_words", done->frames_without_words)
      .add("dropped_observations", done->dropped_observations)
      .add("dropped_claims", done->dropped_claims)
      .add("quarantined_edges", done->quarantined_edges)
      .add("bridges", done->bridges)
      .add("rebuilt", done->rebuilt)
      .add("remaining", done->remaining);
  if (answer.damage) answer.status = Status(Reason::DATA_LOSS, "the map is consistent again, but some data are lost");
  return answer;
}

}  // namespace

void add_repair(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("repair",
                                     "repair a damaged map: move damaged data "
                                     "aside, and rebuild derived data");
  auto directory = std::make_shared<std::string>();
  command->add_option("DIR", *directory, "data folder; no daemon may own it")->type_name("FOLDER");
  command->footer(R"(
Damaged data are kept in DIR/quarantine. If the command is interrupted, run it again.

Exit codes:
  0  nothing was lost
  3  some data are lost; the summary lists them

Examples:
  relmap-admin repair /var/lib/relmap/map)");
  command->callback(
      [&action, directory] { action = [directory](Context& context) { return repair_map(*directory, context); }; });
}

}  // namespace relmap::admin
