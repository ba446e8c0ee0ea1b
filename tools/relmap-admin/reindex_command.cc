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
  if (!s.changed) return context.say("the words are this vocabulary's already, and as they were");
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
                   "a map is reindexed while no daemon works on it: stop the daemon, and run "
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
    return {{stopped.reason(), stopped.message() + ": no daemon serves the map until a reindex has come to its end"},
            false,
            {}};
  if (!done.ok()) return {done.status(), done.reason() == Reason::DATA_LOSS, {}};
  // The places of the former words; the daemon would see that itself, and say so.
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
                               directory + "` has seen to them");
  return answer;
}

}  // namespace

void add_reindex(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("reindex", "make the words of a map anew, with another vocabulary; nothing else changes");
  auto directory = std::make_shared<std::string>();
  auto vocabulary = std::make_shared<std::string>();
  command->add_option("DIR", *directory, "data folder that no daemon works on");
  command->add_option("--vocabulary", *vocabulary, "visual vocabulary (default: the one shipped)")->type_name("FILE");
  command->footer(R"(
A map keeps the features of its frames, and a word for each. A daemon with another vocabulary than the words were made
with refuses the map (WRONG_VOCABULARY). This makes them anew: some hundred frames a second on each processor.

Interrupted, it leaves a map that every daemon refuses until a reindex, with any vocabulary, has come to its end. If the
words are this vocabulary's already, nothing is done.
Exit code 0: done, or nothing to do. 1: NO_SUCH_FILE, CORRUPT, UNKNOWN_FORMAT_VERSION (the vocabulary, or the map),
DISK_FULL, IO_ERROR. 3: DATA_LOSS, some of the map is damaged. 4: FOLDER_LOCKED, a daemon works on it. 130: interrupted.

  relmap-admin reindex /var/lib/relmap
  relmap-admin reindex /var/lib/relmap --vocabulary campus.vocab)");
  command->callback([&action, directory, vocabulary] {
    action = [directory, vocabulary](Context& context) { return reindex_map(*directory, *vocabulary, context); };
  });
}

}  // namespace relmap::admin
