// relmap-vocab: trains, describes and measures vocabularies.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "proto/base/hex.h"
#include "server/place/vocabulary.h"
#include "server/place/vocabulary_training.h"
#include "tools/terminal/command_line.h"
#include "tools/terminal/console.h"
#include "tools/terminal/progress_bar.h"
#include "tools/vocab/evaluation.h"
#include "tools/vocab/picture_folder.h"
#include "tools/vocab/recognition_set.h"
#include "tools/vocab/reliability.h"
#include "tools/vocab/training_pictures.h"

namespace relmap::vocab {
namespace {

int fail(const Status& status) {
  std::fprintf(stderr, "relmap-vocab: %s\n", status.to_string().c_str());
  return 1;
}

// Shows how far the work has come, in per cent.
class Percentage {
 public:
  void show(std::string_view stage, double share) {
    bar_.show(std::string(stage), static_cast<std::uint64_t>(100 * share), 100, "%");
  }
  std::function<void(double)> of(const char* stage) {
    return [this, stage](double share) { show(stage, share); };
  }

 private:
  terminal::ProgressBar bar_{std::cerr, terminal::is_terminal()};
};

struct TrainArguments {
  std::string out;
  std::vector<std::string> pictures;
  std::size_t every = 1;
  std::size_t views = 1;
  place::TrainingOptions options;
};

int train(const TrainArguments& arguments) {
  const auto files = list_pictures(arguments.pictures, arguments.every);
  if (!files.ok()) return fail(files.status());
  Percentage progress;
  const auto pictures = describe_pictures(*files, arguments.views, progress.of("pictures"));
  if (!pictures.ok()) return fail(pictures.status());
  const auto model = place::train_vocabulary(
      *pictures, arguments.options, [&](std::string_view stage, double share) { progress.show(stage, share); });
  if (!model.ok()) return fail(model.status());
  if (const Status status = write_file(arguments.out, place::encode_vocabulary(*model)); !status.ok())
    return fail(status);
  std::printf("%s: %zu words from %zu pictures in %zu files\n", arguments.out.c_str(), model->centroids.size(),
              pictures->size(), files->size());
  return 0;
}

int info(const std::string& path) {
  const auto loaded = place::Vocabulary::load(path);
  if (!loaded.ok()) return fail(loaded.status());
  const place::Vocabulary& v = **loaded;
  double words = 0;
  for (std::size_t i = 0; i < v.sample_places(); ++i) words += static_cast<double>(v.sample_place(i).size());
  const auto marginal = v.marginal();
  const auto [rarest, commonest] = std::minmax_element(marginal.begin(), marginal.end());
  std::printf("file           %s (%s)\n", path.c_str(), terminal::bytes_text(std::filesystem::file_size(path)).c_str());
  std::printf("identity       %s\n", hex(v.crc()).c_str());
  std::printf("source         %s\n", v.source().c_str());
  std::printf("words          %s\n", count_text(v.size()).c_str());
  std::printf("p(word)        %.4f .. %.4f, mean %.4f\n", static_cast<double>(*rarest), static_cast<double>(*commonest),
              std::accumulate(marginal.begin(), marginal.end(), 0.0) / static_cast<double>(v.size()));
  std::printf("sample places  %s, %.0f words each\n", count_text(v.sample_places()).c_str(),
              words / static_cast<double>(v.sample_places()));
  return 0;
}

struct EvaluateArguments {
  std::string set, vocabulary = place::default_vocabulary_path(), diagram;
  std::vector<std::string> folders;
  bool no_geometry = false, json = false;
};

// part / whole as text, or `nothing` if `whole` is 0.
std::string share(std::size_t part, std::size_t whole, const char* nothing) {
  if (whole == 0) return nothing;
  char text[32];
  std::snprintf(text, sizeof text, "%.4f", static_cast<double>(part) / static_cast<double>(whole));
  return text;
}

class Figures {
 public:
  explicit Figures(bool json) : json_(json) {}
  ~Figures() {
    if (json_) std::printf("}\n");
  }
  void print(const std::string& key, const std::string& value) {
    std::printf(json_ ? "%s\"%s\":%s" : "%s%-40s %s\n", json_ ? (first_ ? "{" : ",") : "", key.c_str(), value.c_str());
    first_ = false;
  }
  void print(const std::string& key, std::size_t count) { print(key, std::to_string(count)); }
  void print(const std::string& key, double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4f", value);
    print(key, std::string(text));
  }
  void print_share(const std::string& key, std::size_t part, std::size_t whole) {
    print(key, share(part, whole, json_ ? "null" : "-"));
  }
  void print(const std::string& of, const Recall& recall) {
    for (std::size_t k = 0; k < kFirst.size(); ++k)
      print(of + "among_first_" + std::to_string(kFirst[k]), recall.among_first[k]);
    print(of + "right_at_full_precision", recall.at_full_precision);
  }

 private:
  const bool json_;
  bool first_ = true;
};

void print_evaluation(const Evaluation& e, bool verified, bool json) {
  Figures figures(json);
  figures.print_share("precision", e.right, e.answered);
  figures.print_share("recall_at_full_precision", e.ours.before.at_full_precision, e.seen_before);
  figures.print_share("tfidf_recall_at_full_precision", e.tfidf.before.at_full_precision, e.seen_before);
  figures.print_share("new_place_right_share", e.new_places_right, e.new_places);
  figures.print("log_probability", e.log_probability);
  figures.print("calibration_error", reliability(e.predictions).error);
  figures.print("queries", e.queries);
  figures.print("seen_before", e.seen_before);
  figures.print("new_places", e.new_places);
  figures.print("answered", e.answered);
  figures.print("right", e.right);
  figures.print("", e.ours.before);
  figures.print("tfidf_", e.tfidf.before);
  if (!verified) return;
  for (const auto& [of, candidates] : {std::pair("verified_", e.ours), std::pair("tfidf_verified_", e.tfidf)}) {
    figures.print(of, candidates.after);
    figures.print(of + std::string("queries"), candidates.verified);
    figures.print(of + std::string("wrong"), candidates.verified_wrong);
  }
}

int measure(const EvaluateArguments& arguments) {
  const auto vocabulary = place::Vocabulary::load(arguments.vocabulary);
  if (!vocabulary.ok()) return fail(vocabulary.status());
  const auto set = load_recognition_set(arguments.set, arguments.folders);
  if (!set.ok()) return fail(set.status());
  Percentage progress;
  const auto result = evaluate(*vocabulary, *set, !arguments.no_geometry, progress.of("pictures"));
  if (!result.ok()) return fail(result.status());
  print_evaluation(*result, !arguments.no_geometry, arguments.json);
  return 0;
}

// SET=FOLDER, or SET=FOLDER,FOLDER...
int measure_reliability(const std::vector<std::string>& sets, const EvaluateArguments& arguments) {
  const auto vocabulary = place::Vocabulary::load(arguments.vocabulary);
  if (!vocabulary.ok()) return fail(vocabulary.status());
  Percentage progress;
  std::vector<ReliabilityCurve> curves;
  std::map<std::string, std::vector<Prediction>> predictions;
  for (const std::string& text : sets) {
    const std::string name = text.substr(0, text.find('='));
    std::vector<std::string> folders;
    std::istringstream list(text.substr(std::min(text.size(), name.size() + 1)));
    for (std::string folder; std::getline(list, folder, ',');) folders.push_back(folder);
    const auto set = load_recognition_set(name, folders);
    if (!set.ok()) return fail(set.status());
    const auto result = evaluate(*vocabulary, *set, false, progress.of("pictures"));
    if (!result.ok()) return fail(result.status());
    auto& of_name = predictions[name];
    of_name.insert(of_name.end(), result->predictions.begin(), result->predictions.end());
  }
  for (const auto& [name, of_name] : predictions) {
    curves.push_back({name, reliability(of_name)});
    std::printf("%-12s %5zu predictions, off by %.4f\n", name.c_str(), curves.back().reliability.predictions,
                curves.back().reliability.error);
  }
  const std::string svg = draw(curves);
  if (const Status status = write_file(arguments.diagram, Bytes(svg.begin(), svg.end())); !status.ok())
    return fail(status);
  return 0;
}

}  // namespace
}  // namespace relmap::vocab

int main(int argc, char** argv) {
  CLI::App app("Visual vocabularies of relmap: words, their Chow-Liu tree, and sample places.", "relmap-vocab");
  relmap::terminal::add_standard_options(app);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  relmap-vocab train --out my.vocab --source 'our yard, 2026; internal' --every 5 /recordings/yard/left\n"
      "  relmap-vocab info my.vocab\n"
      "  relmap-vocab evaluate --vocabulary my.vocab --set drive drive --json\n"
      "\n"
      "Exit codes:\n"
      "  0  done\n"
      "  1  failed; the reason is on stderr\n"
      "  2  wrong usage");

  relmap::vocab::TrainArguments arguments;
  CLI::App* train = app.add_subcommand("train", "Train a vocabulary on pictures");
  train->add_option("--out", arguments.out, "File to write")->type_name("FILE")->required();
  train->add_option("pictures", arguments.pictures, "JPEG, PNG or WebP files, or folders of them")
      ->type_name("FILE|FOLDER")
      ->required();
  train->add_option("--words", arguments.options.words, "Number of words, at most")->capture_default_str();
  train
      ->add_option("--sample-places", arguments.options.sample_places,
                   "Number of pictures kept as samples of unknown places")
      ->capture_default_str();
  train->add_option("--every", arguments.every, "Use every n-th picture of a folder")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  train
      ->add_option("--views", arguments.views,
                   "Number of views, at most, that are taken of a picture much larger than a camera's")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  train->add_option("--seed", arguments.options.seed, "Seed of k-means")->capture_default_str();
  train
      ->add_option("--source", arguments.options.source,
                   "What the pictures are, and their licence; kept in the vocabulary")
      ->required();
  train->footer(
      "Example:\n"
      "  relmap-vocab train --out my.vocab --source 'our yard, 2026; internal' --every 5 /recordings/yard/left");

  std::string file = relmap::place::default_vocabulary_path();
  CLI::App* info = app.add_subcommand("info", "Describe a vocabulary (default: the one shipped)");
  info->add_option("file", file, "Vocabulary")->type_name("FILE");
  info->footer("Example:\n  relmap-vocab info my.vocab");

  relmap::vocab::EvaluateArguments evaluation;
  CLI::App* evaluate =
      app.add_subcommand("evaluate", "Measure how well places are recognised, in comparison with tf-idf");
  const auto add_vocabulary = [&](CLI::App* command) {
    command->add_option("--vocabulary", evaluation.vocabulary, "Vocabulary file (default: the one shipped)")
        ->type_name("FILE");
  };
  constexpr const char* kSets =
      "rtabmap (or corridor: two laps of a corridor), euroc, drive (of relmap-sim), tower (find the floor), tower-area "
      "(find the area of the floor), walk (photographs along a street find those next to them), front (photographs of "
      "one building find each other)";
  evaluate->add_option("--set", evaluation.set, std::string("Kind of the set in the first PATH: ") + kSets)
      ->required()
      ->check(CLI::IsMember({"rtabmap", "corridor", "euroc", "drive", "tower", "tower-area", "walk", "front"}));
  evaluate
      ->add_option(
          "path", evaluation.folders,
          "Folder of the set; then, for tower, folders of more floors; for walk and front, of pictures of other places")
      ->type_name("FOLDER")
      ->required();
  add_vocabulary(evaluate);
  evaluate->add_flag("--no-geometry", evaluation.no_geometry, "Measure recognition only, several times as fast");
  evaluate->add_flag("--json", evaluation.json, "Print one JSON object");
  evaluate->footer(
      "Pictures are shown one by one: each asks for its place, and then becomes a place itself.\n"
      "\n"
      "Figures:\n"
      "  among_first_K            queries with the right place among the first K candidates, of those seen before\n"
      "  right_at_full_precision  queries whose first candidate is right, and more probable than any wrong first one\n"
      "  verified_...             the same after geometry has tried the first five candidates\n"
      "  tfidf_...                the same with tf-idf on the same words\n"
      "  precision                share of right answers among those with p > 0.5\n"
      "  new_place_right_share    share of queries of new places with p(new) > 0.5\n"
      "  log_probability          mean logarithm of the probability given to the truth\n"
      "  calibration_error        mean difference between a probability and the share of such answers that are right\n"
      "\n"
      "Examples:\n"
      "  relmap-vocab evaluate --vocabulary my.vocab --set drive drive --json\n"
      "  relmap-vocab evaluate --set tower floor-1 floor-2 floor-3");

  std::vector<std::string> sets;
  CLI::App* reliability = app.add_subcommand(
      "reliability", "Draw a reliability diagram: do probabilities agree with how often they come true?");
  reliability->add_option("--out", evaluation.diagram, "SVG file to write")->type_name("FILE")->required();
  reliability->add_option("sets", sets, std::string("SET=FOLDER[,FOLDER...]; SET is ") + kSets)->required();
  add_vocabulary(reliability);
  reliability->footer("Example:\n  relmap-vocab reliability --out reliability.svg drive=drive rtabmap=corridor");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return relmap::terminal::end_with(app, error, std::cout, std::cerr, 2);
  }
  if (train->parsed()) return relmap::vocab::train(arguments);
  if (info->parsed()) return relmap::vocab::info(file);
  return reliability->parsed() ? relmap::vocab::measure_reliability(sets, evaluation)
                               : relmap::vocab::measure(evaluation);
}
