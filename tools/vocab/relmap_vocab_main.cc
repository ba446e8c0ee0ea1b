// relmap-vocab: trains and describes vocabularies.
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
#include "tools/vocab/picture_folder.h"

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
  TrainingOptions options;
};

int train(const TrainArguments& arguments) {
  const auto files = list_pictures(arguments.pictures, arguments.every);
  if (!files.ok()) return fail(files.status());
  std::vector<std::vector<Descriptor>> pictures;
  for (const std::string& file : *files) {
    const auto features = appearance_of(file);
    if (!features.ok()) return fail(Status(features.reason(), file + ": " + features.status().message()));
    auto& descriptors = pictures.emplace_back();
    for (const AppearanceFeature& feature : *features) descriptors.push_back(feature.descriptor);
    show_progress("pictures", static_cast<double>(pictures.size()) / static_cast<double>(files->size()));
  }
  const auto model = train_vocabulary(pictures, arguments.options, show_progress);
  if (!model.ok()) return fail(model.status());
  if (const Status status = write_file(arguments.out, encode_vocabulary(*model)); !status.ok()) return fail(status);
  std::printf("%s: %zu words from %zu pictures\n", arguments.out.c_str(), model->centroids.size(), pictures.size());
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

}  // namespace
}  // namespace relmap

int main(int argc, char** argv) {
  CLI::App app{"Visual vocabularies of relmap: words, their Chow-Liu tree, and sample places."};
  app.require_subcommand(1);

  relmap::TrainArguments arguments;
  CLI::App* train = app.add_subcommand("train", "Train a vocabulary on pictures");
  train->add_option("--out", arguments.out, "File to write")->required();
  train->add_option("pictures", arguments.pictures, "JPEG or PNG files, or folders of them")->required();
  train->add_option("--words", arguments.options.words, "Words, at most")->capture_default_str();
  train->add_option("--sample-places", arguments.options.sample_places, "Pictures kept to stand for unknown places")
      ->capture_default_str();
  train->add_option("--every", arguments.every, "Use every n-th picture of a folder")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  train->add_option("--seed", arguments.options.seed, "Of k-means")->capture_default_str();
  train->add_option("--source", arguments.options.source, "What the pictures are, and under which terms")->required();

  std::string file = relmap::default_vocabulary_path();
  CLI::App* info = app.add_subcommand("info", "Describe a vocabulary (by default, the one shipped)");
  info->add_option("file", file, "Vocabulary");

  CLI11_PARSE(app, argc, argv);
  return train->parsed() ? relmap::train(arguments) : relmap::info(file);
}
