#include <filesystem>
#include <memory>

#include "server/place/vocabulary.h"
#include "storage/maintenance/reindex.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/relmap-admin/findings.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

void print(const storage::ReindexSummary& s, const Context& context) {
  if (s.frames == 0) return context.say("the map has no frames yet: it takes any vocabulary");
  if (!s.changed) return context.say("the words are of this vocabulary already; nothing is changed");
  const auto n = [](std::uint64_t value) { return count_text(value); };
  context.bar.end();
  if (context.console.json) return;
  context.console.facts({{"words made anew", n(s.with_words) + " of " + n(s.frames) + " frames"},
                         {"without appearance", n(s.without_appearance) + " frames, which have no words"},
                         {"damaged", n(s.unreadable) + " frames, which have no words now"}});
}

Answer reindex_map(const std::string& directory, const std::string& vocabulary_path, Context& context) {
  if (!context.server.empty())
    return {Status(Reason::FOLDER_LOCKED,
                   "a map can be reindexed only while no daemon owns it: stop the daemon, and run "
                   "`relmap-admin reindex DIR` on its machine"),
            false,
            {}};
  if (directory.empty()) throw CLI::ValidationError("no map is named: give DIR");
  const auto vocabulary =
      place::Vocabulary::load(vocabulary_path.empty() ? place::default_vocabulary_path() : vocabulary_path);
  if (!vocabulary.ok()) return {vocabulary.status(), false, {}};
  if (Status free = check_free(directory); !free.ok()) return {free, false, {}};
  const auto engine = storage::open_rocksdb(directory);
  if (!engine.ok()) return {engine.status(), engine.reason() == Reason::DATA_LOSS, {}};
  const auto words = [&](std::span<const AppearanceFeature> features) { return (*vocabulary)->words(features); };
  const auto done = storage::reindex(
      *engine, words, (*vocabulary)->crc(), [&](const storage::Finding& finding) { print_finding(context, finding); },
      maintenance_progress(context));
  if (Status stopped = check_interrupt(); done.reason() == Reason::SHUTTING_DOWN && !stopped.ok())
    return {
        {stopped.reason(), stopped.message() + ": no daemon opens the map until a reindex has completed"}, false, {}};
  if (!done.ok()) return {done.status(), done.reason() == Reason::DATA_LOSS, {}};
  // The place index is of the former words. The daemon would notice that itself, with a warning.
  std::error_code ignored;
  if (done->changed) std::filesystem::remove_all(directory + "/places", ignored);
  print(*done, context);
  Answer answer;
  answer.damage = done->unreadable > 0;
  answer.json.add("changed", done->changed)
      .add("frames", done->frames)
      .add("with_words", done->with_words)
      .add("without_appearance", done->without_appearance)
      .add("unreadable", done->unreadable)
      .add("former_vocabulary_crc32c", std::uint64_t{done->former_crc})
      .add("vocabulary_crc32c", std::uint64_t{(*vocabulary)->crc()});
  if (answer.damage)
    answer.status = Status(Reason::DATA_LOSS,
                           "the appearance of some frames is damaged; they are not recognised until "
                           "`relmap-admin repair " +
                               directory + "` has repaired them");
  return answer;
}

}  // namespace

void add_reindex(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("reindex", "recompute the words of a map with another vocabulary; nothing else changes");
  auto directory = std::make_shared<std::string>();
  auto vocabulary = std::make_shared<std::string>();
  command->add_option("DIR", *directory, "data folder; no daemon may own it")->type_name("FOLDER");
  command->add_option("--vocabulary", *vocabulary, "visual vocabulary (default: the one shipped)")->type_name("FILE");
  command->footer(R"(
A map keeps the features of its frames, and a word of the vocabulary for each. A daemon that has another vocabulary than
the words are of refuses the map (WRONG_VOCABULARY). This command recomputes the words, some hundred frames a second on
each processor. If they are of the given vocabulary already, it does nothing.

If it is interrupted, every daemon refuses the map until a reindex, with any vocabulary, has completed.

Exit codes:
  0    done, or nothing to do
  1    NO_SUCH_FILE, CORRUPT, UNKNOWN_FORMAT_VERSION (of the vocabulary or the map), DISK_FULL, IO_ERROR
  3    DATA_LOSS: some of the map is damaged
  4    FOLDER_LOCKED: a daemon owns it
  130  interrupted

Examples:
  relmap-admin reindex /var/lib/relmap/map
  relmap-admin reindex /var/lib/relmap/map --vocabulary campus.vocab)");
  command->callback([&action, directory, vocabulary] {
    action = [directory, vocabulary](Context& context) { return reindex_map(*directory, *vocabulary, context); };
  });
}

}  // namespace relmap::admin
