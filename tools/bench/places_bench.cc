// The place index on places of Zipf-distributed words: speed, memory, and the cost of exceeding its share of memory.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numeric>
#include <random>

#include "server/place/place_index.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/testing/endless_drive.h"
#include "storage/testing/temporary_folder.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kWords = 10000;
constexpr std::uint32_t kMinWords = 100, kMaxWords = 300;  // words of a place
constexpr std::uint32_t kQueryFeatures = 300;

struct PlacesOptions {
  std::uint32_t places = 100000;
  double budget_mb = 0;
  int queries = 200;
};

// 100 to 300 different words, drawn by Zipf's law with exponent 1; always the same for the same number.
class Pictures {
 public:
  Pictures() : cumulative_(kWords) {
    double sum = 0;
    for (std::uint32_t w = 0; w < kWords; ++w) cumulative_[w] = sum += 1.0 / (w + 1);
  }
  std::vector<std::uint32_t> place(std::uint32_t number) const {
    std::mt19937_64 random(number);
    const std::uint32_t count = kMinWords + static_cast<std::uint32_t>(random() % (kMaxWords - kMinWords + 1));
    return draw(random, {}, count);
  }
  // Half of what was seen there, half something else.
  std::vector<std::uint32_t> seen_again(std::uint32_t number) const {
    std::vector<std::uint32_t> words = place(number);
    std::mt19937_64 random(~std::uint64_t{number});
    std::shuffle(words.begin(), words.end(), random);
    const std::size_t count = words.size();
    words.resize(count / 2);
    return draw(random, std::move(words), count);
  }

 private:
  std::vector<std::uint32_t> draw(std::mt19937_64& random, std::vector<std::uint32_t> words, std::size_t count) const {
    std::vector<bool> drawn(kWords);
    for (const std::uint32_t word : words) drawn[word] = true;
    while (words.size() < count) {
      const double at = static_cast<double>(random() >> 11) * 0x1p-53 * cumulative_.back();
      const auto word = static_cast<std::uint32_t>(std::lower_bound(cumulative_.begin(), cumulative_.end(), at) -
                                                   cumulative_.begin());
      if (drawn[word]) continue;
      drawn[word] = true;
      words.push_back(word);
    }
    std::sort(words.begin(), words.end());
    return words;
  }
  std::vector<double> cumulative_;
};

// Its marginals are those of the pictures. A word's parent is one of the commoner ones, and shown with it four times as
// often as by chance.
std::shared_ptr<const place::Vocabulary> correlated_vocabulary(const Pictures& pictures) {
  constexpr std::uint32_t kSeen = 4000;  // places from which the marginals are counted
  place::VocabularyModel model = place::random_vocabulary_model(kWords, 1, 1);
  std::vector<double> seen(kWords);
  for (std::uint32_t i = 0; i < kSeen; ++i)
    for (const std::uint32_t word : pictures.place(0x80000000u + i)) ++seen[word];
  for (std::uint32_t w = 0; w < kWords; ++w) {
    const auto probability = [&](std::uint32_t word) { return std::clamp(seen[word] / (kSeen + 1), 0.001, 0.99); };
    const double marginal = probability(w), of_parent = probability(model.parent[w]);
    const double present =
        w == 0 ? marginal : std::min(std::max(marginal, std::min(4 * marginal, 0.9)), marginal / of_parent);
    const double absent = w == 0 ? marginal : (marginal - present * of_parent) / (1 - of_parent);
    model.marginal[w] = static_cast<float>(marginal);
    model.given_parent_present[w] = static_cast<float>(std::min(present, 0.999));
    model.given_parent_absent[w] = static_cast<float>(std::max(absent, 0.0005));
  }
  model.sample_places.clear();
  for (std::uint32_t i = 0; i < 200; ++i) model.sample_places.push_back(pictures.place(0x90000000u + i));
  return place::Vocabulary::from_bytes(place::encode_vocabulary(model)).or_throw();
}

// The features of a few pictures stand for those of all places: what a comparison costs hangs on how many words two
// have in common, not on which.
class DescribedDrive final : public storage::PartialGraph {
 public:
  DescribedDrive(std::uint32_t frames, const Pictures& pictures) : drive_(frames) {
    constexpr std::uint32_t kPictures = 64;
    for (std::uint32_t i = 0; i < kPictures; ++i)
      pictures_.push_back(std::make_shared<storage::FrameCold>(described(pictures.place(i), i)));
  }
  static storage::FrameCold described(std::vector<std::uint32_t> words, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    storage::FrameCold cold;
    cold.words = std::move(words);
    cold.appearance.resize(cold.words.size());
    for (AppearanceFeature& feature : cold.appearance)
      for (std::uint8_t& byte : feature.descriptor) byte = static_cast<std::uint8_t>(random() % 90);
    return cold;
  }
  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override { return drive_.hot(id); }
  std::shared_ptr<const storage::FrameCold> cold(FrameId id) const override {
    return pictures_[id.index % pictures_.size()];
  }
  std::vector<storage::Session> all_sessions() const override { return drive_.sessions(); }
  std::optional<storage::Session> session(SessionNumber number) const override { return drive_.session(number); }

 private:
  storage::EndlessDrive drive_;
  std::vector<std::shared_ptr<const storage::FrameCold>> pictures_;
};

// Loads the shipped vocabulary from its file.
double load_us() {
  const auto start = Clock::now();
  (void)place::Vocabulary::load(place::default_vocabulary_path()).or_throw();
  return microseconds_since(start);
}

// Quantises the 300 descriptors of a picture with the shipped vocabulary.
double quantise_us() {
  const auto vocabulary = place::Vocabulary::load(place::default_vocabulary_path()).or_throw();
  std::mt19937_64 random(1);
  std::vector<AppearanceFeature> features(kQueryFeatures);
  for (AppearanceFeature& feature : features)
    for (std::uint8_t& byte : feature.descriptor) byte = static_cast<std::uint8_t>(random() % 160);
  std::vector<double> times;
  for (int i = 0; i < 20; ++i) {
    const auto start = Clock::now();
    (void)vocabulary->words(features);
    times.push_back(microseconds_since(start));
  }
  return quantile(times, 0.5);
}

void run(const PlacesOptions& options, Report& report) {
  const Pictures pictures;
  const auto vocabulary = correlated_vocabulary(pictures);
  const DescribedDrive graph(options.places, pictures);
  const storage::TemporaryFolder folder;
  place::PlaceIndexOptions index_options{.folder = folder / ""};
  if (options.budget_mb > 0) index_options.allowance = static_cast<std::size_t>(options.budget_mb * (1 << 20));
  place::PlaceIndex index(vocabulary, index_options);
  const std::size_t empty = index.memory_bytes();

  std::vector<double> adds;
  std::size_t max_bytes = 0;
  for (std::uint32_t i = 0; i < options.places; ++i) {
    const auto words = pictures.place(i);
    const auto start = Clock::now();
    (void)index.add({1, i}, words);
    adds.push_back(microseconds_since(start));
    max_bytes = std::max(max_bytes, index.memory_bytes());
  }

  std::vector<double> times, compared;
  double found = 0, revisits = 0;
  std::mt19937 random(3);
  for (int i = 0; i < options.queries; ++i) {
    const bool revisit = i % 2 == 0;
    const auto place = static_cast<std::uint32_t>(random() % options.places);
    const auto query = revisit ? pictures.seen_again(place) : pictures.place(0xa0000000u + place);
    const auto start = Clock::now();
    const place::PlaceAnswer answer = index.query(query, graph);
    times.push_back(microseconds_since(start));
    const storage::FrameCold described = DescribedDrive::described(query, place);
    const auto again = Clock::now();
    (void)index.query(query, graph, {}, {}, described.appearance);
    compared.push_back(microseconds_since(again));
    revisits += revisit;
    found += revisit && !answer.candidates.empty() && answer.candidates[0].frame == FrameId{1, place};
  }

  const auto saving = Clock::now();
  (void)index.save();
  const double save_us = microseconds_since(saving);
  const auto on_disk = static_cast<double>(std::filesystem::file_size(folder / "places/blocks"));
  const auto opening = Clock::now();
  place::PlaceIndex again(vocabulary, index_options);
  (void)again.restore(graph);
  const double restore_us = microseconds_since(opening);

  const double places = options.places;
  report.add("places", static_cast<double>(index.size()), "indexed");
  report.add("places_left_out", static_cast<double>(index.left_out()), "for which there was no room");
  report.add("query_mean_us", mean(times), "a query by words alone, the posterior included");
  report.add("query_p50_us", quantile(times, 0.5), "");
  report.add("query_p99_us", quantile(times, 0.99), "");
  report.add("compared_mean_us", mean(compared), "the same with features, but for reading those of the places");
  report.add("compared_ratio", mean(compared) / mean(times), "of the two");
  report.add("ns_per_place", mean(times) * 1e3 / places, "of the mean query");
  report.add("bytes_per_place", static_cast<double>(index.memory_bytes() - empty) / places,
             "of memory, with a query under way");
  report.add("disk_bytes_per_place", on_disk / places, "in the file");
  report.add("most_mb", static_cast<double>(max_bytes) / (1 << 20), "of memory, the most while it grew");
  report.add("add_us", mean(adds), "adding a place, writing it to the file included");
  report.add("add_max_us", quantile(adds, 1), "the longest");
  report.add("save_us", save_us, "what no full block holds");
  report.add("restore_us", restore_us, "the index as a start finds it");
  report.add("restored", static_cast<double>(again.size()), "places");
  report.add("found", found / revisits, "revisits whose place came first");
  report.add("vocabulary_load_us", load_us(), "the shipped vocabulary, from its file");
  report.add("quantise_us", quantise_us(), "300 descriptors to words of the shipped vocabulary");
}

}  // namespace

Run declare_places(CLI::App& app) {
  auto options = std::make_shared<PlacesOptions>();
  app.add_option("--places", options->places, "Number of places, of 100 to 300 words each")->capture_default_str();
  app.add_option("--budget-mb", options->budget_mb, "Memory budget of the index; 0: unlimited")->capture_default_str();
  app.add_option("--queries", options->queries, "Number of queries, half of them revisits")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
