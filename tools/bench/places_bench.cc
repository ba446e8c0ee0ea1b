// The place index beyond its share of memory: what a query costs when most of the inverted lists are on disk.
#include <algorithm>
#include <chrono>
#include <memory>
#include <random>

#include "server/place/place_index.h"
#include "storage/testing/endless_drive.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kWordsPerPlace = 300;

struct Options {
  std::uint32_t places = 100000;
  double share_mb = 16;
  int queries = 50;
  std::string folder = ".";
};

using Clock = std::chrono::steady_clock;
double microseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// Words as the vocabulary's own marginals have it; always the same for the same place.
class Pictures {
 public:
  explicit Pictures(const Vocabulary& vocabulary)
      : words_(vocabulary.marginal().begin(), vocabulary.marginal().end()) {}
  std::vector<std::uint32_t> place(std::uint32_t number) { return draw(number, kWordsPerPlace); }
  // Half of what was seen there, half something else.
  std::vector<std::uint32_t> seen_again(std::uint32_t number) {
    std::vector<std::uint32_t> words = draw(number, kWordsPerPlace / 2);
    const auto other = draw(number + 0x80000000u, kWordsPerPlace / 2);
    words.insert(words.end(), other.begin(), other.end());
    return words;
  }

 private:
  std::vector<std::uint32_t> draw(std::uint32_t seed, std::uint32_t count) {
    std::mt19937 random(seed);
    std::vector<std::uint32_t> words(count);
    for (std::uint32_t& word : words) word = words_(random);
    return words;
  }
  std::discrete_distribution<std::uint32_t> words_;
};

std::vector<double> ask(const PlaceIndex& index, const Graph& graph, Pictures& pictures, const Options& options,
                        double& found) {
  std::vector<double> times;
  std::mt19937 random(3);
  for (int i = 0; i < options.queries; ++i) {
    const auto place = static_cast<std::uint32_t>(random() % options.places);
    const auto query = pictures.seen_again(place);
    const auto start = Clock::now();
    const PlaceAnswer answer = index.query(query, graph);
    times.push_back(microseconds_since(start));
    found += !answer.candidates.empty() && answer.candidates[0].frame == FrameId{1, place};
  }
  return times;
}

void run(const Options& options, Report& report) {
  const auto vocabulary = Vocabulary::load(default_vocabulary_path()).or_throw();
  Pictures pictures(*vocabulary);
  const EndlessDrive graph(options.places);
  const auto share = static_cast<std::size_t>(options.share_mb * (1 << 20));
  PlaceIndex paged(vocabulary, {share, options.folder});
  std::size_t most = 0;
  std::vector<double> adds;
  for (std::uint32_t i = 0; i < options.places; ++i) {
    const auto words = pictures.place(i);
    const auto start = Clock::now();
    (void)paged.add({1, i}, words);
    adds.push_back(microseconds_since(start));
    most = std::max(most, paged.memory_bytes());
  }
  double found_paged = 0, found = 0;
  const auto on_disk = ask(paged, graph, pictures, options, found_paged);
  PlaceIndex whole(vocabulary);
  for (std::uint32_t i = 0; i < options.places; ++i) (void)whole.add({1, i}, pictures.place(i));
  const auto in_memory = ask(whole, graph, pictures, options, found);

  report.add("places", static_cast<double>(paged.size()), "indexed");
  report.add("places_left_out", static_cast<double>(paged.left_out()), "for which there was no room");
  report.add("share_mb", options.share_mb, "memory that the paged index may use");
  report.add("most_mb", static_cast<double>(most) / (1 << 20), "that it used, with a query under way");
  report.add("whole_mb", static_cast<double>(whole.memory_bytes()) / (1 << 20), "of the same index all in memory");
  report.add("query_paged_p50_us", quantile(on_disk, 0.5), "a query, lists on disk");
  report.add("query_paged_p99_us", quantile(on_disk, 0.99), "");
  report.add("query_memory_p50_us", quantile(in_memory, 0.5), "a query, lists in memory");
  report.add("query_memory_p99_us", quantile(in_memory, 0.99), "");
  report.add("add_mean_us", mean(adds), "adding a place, paging out included");
  report.add("add_max_us", quantile(adds, 1), "the longest");
  report.add("found_paged", found_paged / options.queries, "queries whose place came first");
  report.add("found_memory", found / options.queries, "");
}

}  // namespace

Run declare_places(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("--places", options->places, "Places, of 300 words each")->capture_default_str();
  app.add_option("--share-mb", options->share_mb, "Memory that the index may use")->capture_default_str();
  app.add_option("--queries", options->queries, "Questions")->capture_default_str();
  app.add_option("--folder", options->folder, "For temporary files")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
