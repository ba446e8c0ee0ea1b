// relmap-vocab: trains, describes and measures vocabularies.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

#include "server/place/vocabulary.h"
#include "server/place/vocabulary_training.h"
#include "tools/vocab/evaluation.h"
#include "tools/vocab/picture_folder.h"
#include "tools/vocab/recognition_set.h"
#include "tools/vocab/training_pictures.h"

namespace relmap {
namespace {

int fail(const Status& status) {
  std::fprintf(stderr, "relmap-vocab: %s\n", status.to_string().c_str());
  return 1;
}

// One line, rewritten; silent where nobody watches.
void show_progress(std::string_view stage, double share) {
  if (!isatty(STDERR_FILENO)) return;
  std::fprintf(stderr, "\r%-12.*s %5.1f %%%s", static_cast<int>(stage.size()), stage.data(), 100 * share,
               share >= 1 ? "\n" : "");
}

struct TrainArguments {
  std::string out;
  std::vector<std::string> pictures;
  std::size_t every = 1;
  std::size_t views = 1;
  TrainingOptions options;
};

int train(const TrainArguments& arguments) {
  const auto files = list_pictures(arguments.pictures, arguments.every);
  if (!files.ok()) return fail(files.status());
  const auto pictures =
      describe_pictures(*files, arguments.views, [](double share) { show_progress("pictures", share); });
  if (!pictures.ok()) return fail(pictures.status());
  const auto model = train_vocabulary(*pictures, arguments.options, show_progress);
  if (!model.ok()) return fail(model.status());
  if (const Status status = write_file(arguments.out, encode_vocabulary(*model)); !status.ok()) return fail(status);
  std::printf("%s: %zu words from %zu pictures in %zu files\n", arguments.out.c_str(), model->centroids.size(),
              pictures->size(), files->size());
  return 0;
}

int info(const std::string& path) {
  const auto loaded = Vocabulary::load(path);
  if (!loaded.ok()) return fail(loaded.status());
  const Vocabulary& v = **loaded;
  double words = 0;
  for (std::size_t i = 0; i < v.sample_places(); ++i) words += static_cast<double>(v.sample_place(i).size());
  const auto marginal = v.marginal();
  const auto [rarest, commonest] = std::minmax_element(marginal.begin(), marginal.end());
  std::printf("file           %s (%ju bytes)\n", path.c_str(),
              static_cast<std::uintmax_t>(std::filesystem::file_size(path)));
  std::printf("identity       %08x\n", v.crc());
  std::printf("source         %s\n", v.source().c_str());
  std::printf("words          %u\n", v.size());
  std::printf("p(word)        %.4f .. %.4f, mean %.4f\n", static_cast<double>(*rarest), static_cast<double>(*commonest),
              std::accumulate(marginal.begin(), marginal.end(), 0.0) / static_cast<double>(v.size()));
  std::printf("sample places  %zu, %.0f words each\n", v.sample_places(),
              words / static_cast<double>(v.sample_places()));
  return 0;
}

struct EvaluateArguments {
  std::string set, folder, vocabulary = default_vocabulary_path();
  bool json = false;
};

// A share, or that there was nothing to share out.
std::string share(std::size_t part, std::size_t whole, const char* nothing) {
  if (whole == 0) return nothing;
  char text[32];
  std::snprintf(text, sizeof text, "%.4f", static_cast<double>(part) / static_cast<double>(whole));
  return text;
}

void print_evaluation(const Evaluation& e, bool json) {
  auto print = [&, first = true](const char* key, const std::string& value) mutable {
    std::printf(json ? "%s\"%s\":%s" : "%s%-31s %s\n", json ? (first ? "{" : ",") : "", key, value.c_str());
    first = false;
  };
  const auto print_share = [&](const char* key, std::size_t part, std::size_t whole) {
    print(key, share(part, whole, json ? "null" : "-"));
  };
  print_share("precision", e.right, e.answered);
  print_share("recall_at_full_precision", e.right_at_full_precision, e.seen_before);
  print_share("tfidf_recall_at_full_precision", e.tfidf_right_at_full_precision, e.seen_before);
  print_share("new_place_right_share", e.new_places_right, e.new_places);
  char text[32];
  std::snprintf(text, sizeof text, "%.4f", e.log_probability);
  print("log_probability", text);
  print("queries", std::to_string(e.queries));
  print("seen_before", std::to_string(e.seen_before));
  print("new_places", std::to_string(e.new_places));
  print("answered", std::to_string(e.answered));
  print("right", std::to_string(e.right));
  if (json) std::printf("}\n");
}

int measure(const EvaluateArguments& arguments) {
  const auto vocabulary = Vocabulary::load(arguments.vocabulary);
  if (!vocabulary.ok()) return fail(vocabulary.status());
  const auto set = load_recognition_set(arguments.set, arguments.folder);
  if (!set.ok()) return fail(set.status());
  const auto result = evaluate(*vocabulary, *set, [](double done) { show_progress("pictures", done); });
  if (!result.ok()) return fail(result.status());
  print_evaluation(*result, arguments.json);
  return 0;
}

}  // namespace
}  // namespace relmap

int main(int argc, char** argv) {
  CLI::App app{"Visual vocabularies of relmap: words, their Chow-Liu tree, and sample places."};
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  relmap-vocab train --out my.vocab --source 'our yard, 2026; internal' --every 5 /recordings/yard/left\n"
      "  relmap-vocab info my.vocab\n"
      "  relmap-vocab evaluate --vocabulary my.vocab --set drive drive --json\n"
      "Exit codes: 0 done; 1 failed, the reason on stderr; above 100 the command line was not understood.");

  relmap::TrainArguments arguments;
  CLI::App* train = app.add_subcommand("train", "Train a vocabulary on pictures");
  train->add_option("--out", arguments.out, "File to write")->required();
  train->add_option("pictures", arguments.pictures, "JPEG, PNG or WebP files, or folders of them")->required();
  train->add_option("--words", arguments.options.words, "Words, at most")->capture_default_str();
  train->add_option("--sample-places", arguments.options.sample_places, "Pictures kept to stand for unknown places")
      ->capture_default_str();
  train->add_option("--every", arguments.every, "Use every n-th picture of a folder")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  train->add_option("--views", arguments.views, "Pictures taken of one that is much larger than a camera's, at most")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  train->add_option("--seed", arguments.options.seed, "Of k-means")->capture_default_str();
  train->add_option("--source", arguments.options.source, "What the pictures are, and under which terms")->required();

  std::string file = relmap::default_vocabulary_path();
  CLI::App* info = app.add_subcommand("info", "Describe a vocabulary (by default, the one shipped)");
  info->add_option("file", file, "Vocabulary");

  relmap::EvaluateArguments evaluation;
  CLI::App* evaluate = app.add_subcommand("evaluate", "Measure how well places are recognised, and against tf-idf");
  evaluate
      ->add_option("--set", evaluation.set,
                   "What PATH holds: rtabmap (or corridor: two laps of one), euroc, tower, or a drive of relmap-sim")
      ->check(CLI::IsMember({"rtabmap", "corridor", "euroc", "tower", "drive"}))
      ->required();
  evaluate->add_option("path", evaluation.folder, "Folder of the set")->required();
  evaluate->add_option("--vocabulary", evaluation.vocabulary, "By default, the one shipped");
  evaluate->add_flag("--json", evaluation.json, "One JSON object");
  evaluate->footer(
      "Pictures are shown one by one: each asks for its place and then becomes one. Answers are those before "
      "geometric\n"
      "verification. precision: of answers with p > 0.5. recall_at_full_precision: of queries whose place was seen\n"
      "before, answered rightly and with more than the highest p of a wrong answer. new_place_right_share: of queries\n"
      "whose place is new, p(new) > 0.5. log_probability: mean of the truth's.");

  CLI11_PARSE(app, argc, argv);
  return train->parsed() ? relmap::train(arguments) : info->parsed() ? relmap::info(file) : relmap::measure(evaluation);
}
