#include "server/place/place_index.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <new>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "proto/base/mutex.h"
#include "server/place/block_scores.h"
#include "server/place/compare_places.h"
#include "server/place/fabmap_model.h"
#include "server/place/inverted_index.h"
#include "server/place/place_neighbours.h"
#include "server/place/posterior.h"
#include "server/place/shortlist.h"

namespace relmap::place {
namespace {

constexpr std::size_t kMaxSeeds = 64;

// All places stand for the unknown world except those within kNearEdges edges of the kPasses best ones. There are two
// best ones, since a place may have been passed twice without an edge between the passes yet.
constexpr std::uint32_t kNearEdges = 2 * kPlaceRadius;
constexpr int kPasses = 2;

struct Group {
  std::uint32_t best;
  std::vector<std::uint32_t> members;  // including `best`
};

// The sample places of the vocabulary, as blocks.
std::vector<Bytes> sample_blocks(const Vocabulary& vocabulary, const FabMapModel& model) {
  std::vector<Bytes> blocks;
  std::vector<PlaceWords> places;
  const auto n = static_cast<std::uint32_t>(vocabulary.sample_places());
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto words = vocabulary.sample_place(i);
    places.push_back({{1, i}, {words.begin(), words.end()}});
    if (places.size() < kPlacesPerBlock && i + 1 < n) continue;
    blocks.push_back(encode_place_block(model, nullptr, places));
    places.clear();
  }
  return blocks;
}

std::size_t bytes_of(const std::vector<Bytes>& blocks) {
  std::size_t bytes = 0;
  for (const Bytes& block : blocks) bytes += block.capacity();
  return bytes;
}

// The posterior of each place of the map.
class PlaceMasses {
 public:
  PlaceMasses(const PlaceScores& scores, const Posterior& posterior, std::span<const std::uint32_t> expected)
      : scores_(scores), posterior_(posterior), expected_(expected.begin(), expected.end()) {}

  double operator()(std::uint32_t place) const {
    const LogLikelihood value = scores_.values[place];
    return expected_.contains(place) ? posterior_.mass_of_expected(value) : posterior_.mass(value);
  }

 private:
  const PlaceScores& scores_;
  const Posterior& posterior_;
  const std::unordered_set<std::uint32_t> expected_;
};

// Places of the frames up to `radius` steps from `centre`, without those that were added since the query began.
std::vector<std::uint32_t> places_around(const PlaceScores& scores, const storage::Graph& graph, FrameId centre,
                                         std::uint32_t radius) {
  std::vector<std::uint32_t> places;
  for (const FrameId frame : place_neighbours(graph, centre, radius))
    if (const std::uint32_t place = scores.find(frame); place != FrameTable::kNone) places.push_back(place);
  return places;
}

// Groups frames to places greedily, best frame first: a frame belongs to the first place that reaches it.
std::vector<Group> group(const PlaceScores& scores, const Posterior& posterior, const PlaceMasses& masses,
                         std::span<const std::uint32_t> expected, const storage::Graph& graph) {
  struct Seed {
    std::uint32_t place;
    double mass;
  };
  std::vector<Seed> seeds;
  const auto offer = [&](std::uint32_t place) {
    if (const double mass = masses(place); mass >= kMinSeed) seeds.push_back({place, mass});
  };
  const LogLikelihood lowest = posterior.lowest_with(kMinSeed);
  for (const std::uint32_t place : expected)
    if (scores.values[place] < lowest) offer(place);
  for (std::size_t block = 0; block < scores.highest.size(); ++block) {
    if (scores.highest[block] < lowest) continue;
    const auto values = scores.of_block(block);
    for (std::uint32_t i = 0; i < values.size(); ++i)
      if (values[i] >= lowest) offer(static_cast<std::uint32_t>(block * kPlacesPerBlock) + i);
  }
  const auto better = [&](const Seed& x, const Seed& y) {
    if (x.mass != y.mass) return x.mass > y.mass;
    const LogLikelihood value_x = scores.values[x.place], value_y = scores.values[y.place];
    return value_x != value_y ? value_x > value_y : scores.frame(x.place) < scores.frame(y.place);
  };
  const std::size_t kept = std::min<std::size_t>(seeds.size(), 16 * kMaxSeeds);
  std::partial_sort(seeds.begin(), seeds.begin() + static_cast<std::ptrdiff_t>(kept), seeds.end(), better);
  seeds.resize(kept);

  std::vector<Group> groups;
  std::unordered_set<std::uint32_t> grouped;
  for (const Seed& seed : seeds) {
    if (groups.size() == kMaxSeeds) break;
    if (grouped.contains(seed.place)) continue;
    Group group{seed.place, {}};
    for (const std::uint32_t place : places_around(scores, graph, scores.frame(seed.place), kPlaceRadius))
      if (grouped.insert(place).second) group.members.push_back(place);
    groups.push_back(std::move(group));
  }
  return groups;
}

// The best place that is not among `taken`; of equally good ones, that of the lowest frame. kNone if there is none.
std::uint32_t best_place(const PlaceScores& scores, const std::unordered_set<std::uint32_t>& taken) {
  std::uint32_t best = FrameTable::kNone;
  for (std::size_t block = 0; block < scores.highest.size(); ++block) {
    if (best != FrameTable::kNone && scores.highest[block] < scores.values[best]) continue;
    const auto values = scores.of_block(block);
    for (std::uint32_t i = 0; i < values.size(); ++i) {
      const auto place = static_cast<std::uint32_t>(block * kPlacesPerBlock) + i;
      if (values[i] == kLeftOut || (best != FrameTable::kNone && values[i] < scores.values[best])) continue;
      if (best != FrameTable::kNone && values[i] == scores.values[best] && scores.frame(best) < scores.frame(place))
        continue;
      if (!taken.contains(place)) best = place;
    }
  }
  return best;
}

// The places that the query may well show. They must not stand for the unknown world: if they did, they would raise the
// likelihood of a new place.
std::vector<std::uint32_t> places_near_the_best(const PlaceScores& scores, const storage::Graph& graph) {
  std::unordered_set<std::uint32_t> near;
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::uint32_t best = best_place(scores, near);
    if (best == FrameTable::kNone) break;
    const auto around = places_around(scores, graph, scores.frame(best), kNearEdges);
    near.insert(around.begin(), around.end());
  }
  return {near.begin(), near.end()};
}

std::vector<std::uint32_t> expected_places(const PlaceScores& scores, const storage::Graph& graph,
                                           std::optional<FrameId> near) {
  if (!near) return {};
  std::vector<std::uint32_t> places = places_around(scores, graph, *near, kExpectedRadius);
  std::erase_if(places, [&](std::uint32_t place) { return scores.values[place] == kLeftOut; });
  return places;
}

double total(const Group& group, const PlaceMasses& masses) {
  double sum = 0;
  for (const std::uint32_t member : group.members) sum += masses(member);
  return sum;
}

}  // namespace

// The memory of one query, reused from query to query.
struct QueryMemory {
  explicit QueryMemory(const FabMapModel& model) : blocks(model) {}

  BlockScores blocks;
  PlaceScores scores;
};

namespace {

// Likelihoods of the query that was given to blocks.ask() at the sample places.
std::vector<LogLikelihood> at_samples(std::span<const Bytes> samples, BlockScores& blocks) {
  std::vector<LogLikelihood> values;
  for (const Bytes& bytes : samples) {
    const PlaceBlock block = PlaceBlock::trusted(bytes);
    values.resize(values.size() + block.places());
    blocks.of_block(block, values.data() + values.size() - block.places());
  }
  return values;
}

}  // namespace

struct PlaceIndex::Impl {
  Impl(std::shared_ptr<const Vocabulary> v, const PlaceIndexOptions& options)
      : vocabulary(std::move(v)),
        model(*vocabulary),
        samples(sample_blocks(*vocabulary, model)),
        queries(std::max<std::size_t>(options.queries, 1)),
        fixed_bytes(sizeof(Impl) + model.memory_bytes() + queries * BlockScores(model).memory_bytes() +
                    bytes_of(samples)),
        places(model, {options.allowance - std::min(options.allowance, fixed_bytes), queries, options.folder,
                       vocabulary->crc()}) {
    const MutexLock lock(query_mutex);
    for (std::size_t i = 0; i < queries; ++i) idle.push_back(std::make_unique<QueryMemory>(model));
  }

  class Question;
  std::vector<storage::FrameRange> with_sessions_left_out(std::span<const storage::FrameRange> masked);
  std::unique_ptr<QueryMemory> take_memory();
  void give_memory(std::unique_ptr<QueryMemory> memory);

  const std::shared_ptr<const Vocabulary> vocabulary;
  const FabMapModel model;
  const std::vector<Bytes> samples;
  const std::size_t queries;
  const std::size_t fixed_bytes;  // all but the places and the queries' scores

  Mutex query_mutex;
  ConditionVariable query_ended;
  std::vector<std::unique_ptr<QueryMemory>> idle RELMAP_GUARDED_BY(query_mutex);
  std::vector<storage::FrameRange> sessions_left_out RELMAP_GUARDED_BY(query_mutex);

  InvertedIndex places;  // its memory includes the scores of all queries
  std::atomic<std::size_t> left_out = 0;
};

std::unique_ptr<QueryMemory> PlaceIndex::Impl::take_memory() {
  const MutexLock lock(query_mutex);
  query_ended.wait(query_mutex, [this]() RELMAP_REQUIRES(query_mutex) { return !idle.empty(); });
  auto memory = std::move(idle.back());
  idle.pop_back();
  return memory;
}

void PlaceIndex::Impl::give_memory(std::unique_ptr<QueryMemory> memory) {
  memory->scores.end();
  const MutexLock lock(query_mutex);
  idle.push_back(std::move(memory));
  query_ended.notify_all();
}

// One question, with memory that no other uses meanwhile.
class PlaceIndex::Impl::Question {
 public:
  Question(Impl& index, std::vector<std::uint32_t> words, std::span<const storage::FrameRange> masked)
      : index_(index),
        words_(std::move(words)),
        masked_(index.with_sessions_left_out(masked)),
        memory_(index.take_memory()) {}
  ~Question() { index_.give_memory(std::move(memory_)); }
  Question(const Question&) = delete;
  Question& operator=(const Question&) = delete;

  const PlaceScores& score(BlockScores::Counts counts) {
    memory_->blocks.ask(words_, counts);
    index_.places.score(memory_->blocks, masked_, memory_->scores);
    return memory_->scores;
  }
  // Answers by the scores that were computed last alone.
  PlaceAnswer by_words(std::span<const std::uint32_t> expected, const storage::Graph& graph);

 private:
  Impl& index_;
  const std::vector<std::uint32_t> words_;  // sorted and unique
  const std::vector<storage::FrameRange> masked_;
  std::unique_ptr<QueryMemory> memory_;
};

PlaceAnswer PlaceIndex::Impl::Question::by_words(std::span<const std::uint32_t> expected, const storage::Graph& graph) {
  const PlaceScores& scores = memory_->scores;
  const Posterior posterior(scores, at_samples(index_.samples, memory_->blocks), places_near_the_best(scores, graph),
                            expected);
  const PlaceMasses masses(scores, posterior, expected);
  PlaceAnswer answer;
  answer.new_place = posterior.new_place();
  for (const Group& group : group(scores, posterior, masses, expected, graph)) {
    const double mass = total(group, masses);
    if (mass >= kMinProbability) answer.candidates.push_back({scores.frame(group.best), mass});
  }
  most_probable_first(answer.candidates);
  return answer;
}

std::vector<storage::FrameRange> PlaceIndex::Impl::with_sessions_left_out(std::span<const storage::FrameRange> masked) {
  std::vector<storage::FrameRange> all(masked.begin(), masked.end());
  const MutexLock lock(query_mutex);
  all.insert(all.end(), sessions_left_out.begin(), sessions_left_out.end());
  return all;
}

void most_probable_first(std::vector<PlaceCandidate>& candidates) {
  std::sort(candidates.begin(), candidates.end(), [](const PlaceCandidate& x, const PlaceCandidate& y) {
    return x.probability != y.probability ? x.probability > y.probability : x.frame < y.frame;
  });
  if (candidates.size() > kMaxCandidates) candidates.resize(kMaxCandidates);
}

PlaceIndex::PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary, PlaceIndexOptions options)
    : impl_(std::make_unique<Impl>(std::move(vocabulary), options)) {}

PlaceIndex::~PlaceIndex() = default;

Status PlaceIndex::restore(const storage::Graph& map) {
  return impl_->places.restore([&](const FrameRun& run) {
    const auto session = map.session(run.first.session);
    if (!session) return false;
    if (storage::is_going(*session)) return true;
    return session->frames >= run.count && session->first <= run.first.index &&
           run.first.index + (run.count - 1) <= session->last;
  });
}

Status PlaceIndex::save() { return impl_->places.save(); }

Status PlaceIndex::add(FrameId frame, std::span<const std::uint32_t> words) {
  if (words.empty() || contains(frame)) return {};
  Status added;
  try {
    added = impl_->places.add(frame, sorted_unique(words));
  } catch (const std::bad_alloc&) {
    added = {Reason::BUDGET_EXCEEDED, "no memory for another place"};
  }
  if (!added.ok()) ++impl_->left_out;
  return added;
}

void PlaceIndex::leave_out(SessionNumber session) {
  const MutexLock lock(impl_->query_mutex);
  impl_->sessions_left_out.push_back({session, 0, std::numeric_limits<std::uint32_t>::max()});
}

bool PlaceIndex::contains(FrameId frame) const { return impl_->places.contains(frame); }

PlaceAnswer PlaceIndex::query(std::span<const std::uint32_t> words, const storage::Graph& graph,
                              std::span<const storage::FrameRange> masked, std::optional<FrameId> near,
                              std::span<const AppearanceFeature> features) const {
  if (words.empty()) return {};
  Shortlist likeliest;
  {
    Impl::Question question(*impl_, sorted_unique(words), masked);
    if (features.size() == words.size()) {
      const PlaceScores& scores = question.score(BlockScores::Counts::kShown);
      likeliest = shortlist(scores, expected_places(scores, graph, near), graph);
    }
    if (likeliest.groups < kMinGroups) {
      const PlaceScores& scores = question.score(BlockScores::Counts::kTouched);
      return question.by_words(expected_places(scores, graph, near), graph);
    }
  }
  return compare_places({features, words}, likeliest, graph);
}

std::vector<PlaceCandidate> PlaceIndex::by_shown_words(std::span<const std::uint32_t> words,
                                                       const storage::Graph& graph,
                                                       std::span<const storage::FrameRange> masked) const {
  if (words.empty()) return {};
  Impl::Question question(*impl_, sorted_unique(words), masked);
  question.score(BlockScores::Counts::kShown);
  return question.by_words({}, graph).candidates;
}

std::size_t PlaceIndex::size() const { return impl_->places.size(); }

std::size_t PlaceIndex::left_out() const { return impl_->left_out; }

std::size_t PlaceIndex::memory_bytes() const { return impl_->fixed_bytes + impl_->places.memory_bytes(); }

PlaceAnswer metric_answer(PlaceAnswer answer, const PlaceIndex& places, std::span<const std::uint32_t> words,
                          const storage::Graph& graph, std::span<const storage::FrameRange> masked,
                          std::span<const AppearanceFeature> features) {
  const bool mono = std::any_of(answer.candidates.begin(), answer.candidates.end(), [&](const PlaceCandidate& place) {
    return is_mono_session(graph, place.frame.session);
  });
  if (!mono) return answer;
  std::vector<storage::FrameRange> left_out(masked.begin(), masked.end());
  graph.visit_sessions(0, [&](const storage::Session& session) {
    if (!session.header.camera.is_stereo())
      left_out.push_back({session.number, 0, std::numeric_limits<std::uint32_t>::max()});
    return true;
  });
  return places.query(words, graph, left_out, {}, features);
}

}  // namespace relmap::place
