#include <memory>

#include "storage/map/map.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

// The statistics of a folder that no daemon owns, as of the last commit.
Result<client::StoreStats> stats_of(std::shared_ptr<storage::Engine> engine) {
  const auto engine_stats = engine->stats();
  if (!engine_stats.ok()) return engine_stats.status();
  client::StoreStats stats;
  stats.map_bytes = engine_stats->map_bytes;
  stats.blob_bytes = engine_stats->blob_bytes;
  stats.garbage_bytes = engine_stats->garbage_bytes;
  stats.journal_bytes = engine_stats->journal_bytes;
  stats.journal_records = engine_stats->journal_records;
  stats.dropped = engine_stats->dropped;
  stats.properties = engine_stats->properties;
  stats.status.durable_sequence = engine->last_journal_sequence();
  stats.status.applied_sequence = engine->applied_sequence();
  constexpr std::size_t kMemory = std::size_t{64} << 20;
  const auto map = storage::Map::open(std::move(engine), 0, std::make_shared<storage::Budget>(kMemory));
  if (!map.ok()) return map.status();
  const auto view = (*map)->view();
  stats.status.sessions = static_cast<std::uint32_t>(view->session_counts().all);
  stats.status.frames = view->state().keyframes;
  stats.status.gaps = view->state().gaps;
  stats.status.map = view->state().identity;
  stats.status.labels = static_cast<std::uint32_t>(view->labels("").size());
  stats.status.closures_accepted = view->state().closures_accepted;
  stats.status.closures_candidate = view->state().closures_candidate;
  stats.status.closures_quarantined = view->state().closures_quarantined;
  stats.status.closures_removed = view->state().closures_removed;
  return stats;
}

void print(const client::StoreStats& s, Context& context) {
  const auto n = [](std::uint64_t value) { return count_text(value); };
  const auto bytes = [](std::uint64_t value) { return terminal::bytes_text(value); };
  const client::DaemonStatus& map = s.status;
  std::vector<std::pair<std::string, std::string>> facts{
      {"map", counted_text(map.sessions, "session") + ", " + counted_text(map.frames, "frame") + ", " + n(map.gaps) +
                  " given up, " + counted_text(map.labels, "label")},
      {"identity", map.map.known() ? map.map.uuid.to_string() : "none yet: a daemon gives it one"},
      {"loop closures", n(map.closures_accepted) + " accepted, " + counted_text(map.closures_candidate, "candidate") +
                            ", " + n(map.closures_quarantined) + " quarantined, " + n(map.closures_removed) +
                            " removed"},
      {"on disk", bytes(s.map_bytes + s.journal_bytes) +
                      (map.frames > 0 ? ", " + bytes((s.map_bytes + s.journal_bytes) / map.frames) + " a frame" : "")},
      {"  map", bytes(s.map_bytes)},
      {"  of it blobs", bytes(s.blob_bytes) + ", of which garbage " + bytes(s.garbage_bytes)},
      {"  journal", bytes(s.journal_bytes) + ", " + counted_text(s.journal_records, "record") + " kept"},
      {"journal", "durable through " + n(map.durable_sequence) + ", applied through " + n(map.applied_sequence)},
      {"cut off at start", s.dropped.empty() ? "nothing" : s.dropped}};
  context.console.facts(facts);
}

Answer show_stats(const std::string& directory, Context& context) {
  const auto target = open_target(context, directory, Access::kRead);
  if (!target.ok()) return {target.status(), target.reason() == Reason::DATA_LOSS, {}};
  const auto stats = target->daemon ? target->daemon->stats() : stats_of(target->engine);
  if (!stats.ok()) return {stats.status(), stats.reason() == Reason::DATA_LOSS, {}};
  if (!context.console.json) print(*stats, context);
  Json properties;
  for (const auto& [name, value] : stats->properties) properties.add(name, value);
  Answer answer;
  answer.json.add("sessions", stats->status.sessions)
      .add("frames", stats->status.frames)
      .add("gaps", stats->status.gaps)
      .add("labels", stats->status.labels)
      .add("closures_accepted", stats->status.closures_accepted)
      .add("map_bytes", stats->map_bytes)
      .add("blob_bytes", stats->blob_bytes)
      .add("garbage_bytes", stats->garbage_bytes)
      .add("journal_bytes", stats->journal_bytes)
      .add("journal_records", stats->journal_records)
      .add("durable_sequence", stats->status.durable_sequence)
      .add("applied_sequence", stats->status.applied_sequence)
      .add("dropped", stats->dropped)
      .add("properties", properties);
  add_map(answer.json, stats->status.map);
  return answer;
}

}  // namespace

void add_stats(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("stats", "show sizes and counts of map and journal");
  auto directory = std::make_shared<std::string>();
  command->add_option("DIR", *directory, "data folder")->type_name("FOLDER");
  command->footer(R"(
Examples:
  relmap-admin stats /var/lib/relmap/map
  relmap-admin --json stats /var/lib/relmap/map | jq .garbage_bytes)");
  command->callback(
      [&action, directory] { action = [directory](Context& context) { return show_stats(*directory, context); }; });
}

}  // namespace relmap::admin
