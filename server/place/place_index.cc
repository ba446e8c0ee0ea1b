#include "server/place/place_index.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>
#include <unordered_set>

#include "server/place/fabmap_model.h"
#include "server/place/inverted_index.h"
#include "server/place/place_neighbours.h"
#include "server/place/posterior.h"
#include "storage/chunk.h"

namespace relmap {
namespace {

constexpr std::size_t kMaxCandidates = 20;
constexpr double kMinProbability = 1e-3;
// A place whose best frame holds less than this cannot reach kMinProbability with its neighbours.
constexpr double kMinSeed = kMinProbability / 100;
constexpr std::size_t kMaxSeeds = 64;

constexpr std::size_t kOwnSamplesFrom = 2000;  // places, before the map's own stand for the unknown world too
constexpr std::size_t kOwnSamples = 200;
constexpr std::uint32_t kFar = 20;    // edges from every place
constexpr double kLikelyPlace = 0.1;  // that has at least this probability

// Of a query, for each place: its likelihood, its mass, and bits.
constexpr std::size_t kQueryBytes = 2 * sizeof(double) + 1;
// The allowance must leave so much of itself for lists that grow, or the index would page them out place by place.
constexpr std::size_t kFewestListBytes = 16;  // a sixteenth
constexpr std::size_t kAddBytes = 32 * 1024;  // of one place, at most
constexpr std::size_t kPatience = 256;        // places left out before a disk that took nothing is tried again

// Which place a frame is; 5 bytes a frame.
class PlaceNumbers {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::uint32_t find(FrameId frame) const {
    const auto found = chunks_.find(chunk_id(frame));
    return found == chunks_.end() ? kNone : found->second[slot_of(frame)];
  }
  void set(FrameId frame, std::uint32_t place) {
    const auto [chunk, fresh] = chunks_.try_emplace(chunk_id(frame));
    if (fresh) chunk->second.fill(kNone);
    chunk->second[slot_of(frame)] = place;
  }
  std::size_t memory_bytes() const {
    const std::size_t node = sizeof(*chunks_.begin()) + 2 * sizeof(void*);
    return chunks_.bucket_count() * sizeof(void*) + chunks_.size() * node;
  }

 private:
  std::unordered_map<ChunkId, std::array<std::uint32_t, kFramesPerChunk>> chunks_;
};

struct Group {
  std::uint32_t best;
  std::vector<std::uint32_t> members;  // best among them
};

}  // namespace

struct PlaceIndex::Impl {
  Impl(std::shared_ptr<const Vocabulary> v, PlaceIndexOptions o)
      : vocabulary(std::move(v)), options(std::move(o)), model(*vocabulary), places(model) {
    for (std::size_t i = 0; i < vocabulary->sample_places(); ++i) samples.add(vocabulary->sample_place(i));
  }

  std::vector<Group> group(const std::vector<double>& mass, const Graph& graph) const;
  std::vector<std::uint32_t> far_samples(const std::vector<Group>& groups, const std::vector<double>& mass,
                                         const Graph& graph) const;

  FrameId frame_of(std::uint32_t place) const {
    const std::shared_lock lock(mutex);
    return frames[place];
  }

  Status make_room();
  std::size_t memory_bytes() const;

  const std::shared_ptr<const Vocabulary> vocabulary;
  const PlaceIndexOptions options;
  const FabMapModel model;
  InvertedIndex samples{model};  // never changes

  std::mutex query_mutex;  // one query at a time

  mutable std::shared_mutex mutex;  // guards what follows; the writer, who alone changes it, reads without
  InvertedIndex places;
  std::vector<FrameId> frames;  // by place number
  PlaceNumbers numbers;
  // The kOwnSamples places with the lowest hashes, as a max-heap: a choice that does not depend on the order of adding.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sampled;

  std::atomic<std::size_t> left_out = 0;
  std::size_t try_again_at = 0;  // left_out; writer
};

std::size_t PlaceIndex::Impl::memory_bytes() const {
  return sizeof(Impl) + model.memory_bytes() + samples.memory_bytes() + places.memory_bytes() +
         frames.capacity() * sizeof(FrameId) + numbers.memory_bytes() + sampled.capacity() * sizeof(sampled[0]) +
         places.size() * kQueryBytes;
}

// Pages the lists out if another place might not fit.
Status PlaceIndex::Impl::make_room() {
  if (options.allowance - std::min(options.allowance, memory_bytes()) >= kAddBytes) return {};
  const Status full(Reason::BUDGET_EXCEEDED, "the place index fills its share of " + std::to_string(options.allowance) +
                                                 " bytes with " + std::to_string(places.size()) + " places");
  if (options.spill_folder.empty() || places.growing_bytes() < options.allowance / kFewestListBytes) return full;
  if (left_out < try_again_at) return full;
  auto frozen = places.freeze(options.spill_folder);
  if (!frozen.ok()) {
    try_again_at = left_out + kPatience;
    return frozen.status();
  }
  const std::unique_lock lock(mutex);
  places.adopt(std::move(frozen).value());
  return {};
}

// Greedy, best frame first; a frame belongs to the first place that reaches it.
std::vector<Group> PlaceIndex::Impl::group(const std::vector<double>& mass, const Graph& graph) const {
  std::vector<std::uint32_t> seeds;
  std::vector<FrameId> seed_frames;
  for (std::uint32_t i = 0; i < mass.size(); ++i)
    if (mass[i] >= kMinSeed) seeds.push_back(i);
  {
    const std::shared_lock lock(mutex);
    const auto better = [&](std::uint32_t x, std::uint32_t y) {
      return mass[x] != mass[y] ? mass[x] > mass[y] : frames[x] < frames[y];
    };
    const std::size_t kept = std::min<std::size_t>(seeds.size(), 16 * kMaxSeeds);
    std::partial_sort(seeds.begin(), seeds.begin() + static_cast<std::ptrdiff_t>(kept), seeds.end(), better);
    seeds.resize(kept);
    for (const std::uint32_t seed : seeds) seed_frames.push_back(frames[seed]);
  }

  std::vector<Group> groups;
  std::vector<bool> claimed(mass.size());
  for (std::size_t s = 0; s < seeds.size() && groups.size() < kMaxSeeds; ++s) {
    if (claimed[seeds[s]]) continue;
    Group group{seeds[s], {}};
    const std::vector<FrameId> near = place_neighbours(graph, seed_frames[s], kPlaceRadius);
    const std::shared_lock lock(mutex);
    for (const FrameId frame : near) {
      const std::uint32_t place = numbers.find(frame);
      // Places added since the query began have no mass yet.
      if (place >= mass.size() || claimed[place]) continue;
      claimed[place] = true;
      group.members.push_back(place);
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

double total(const Group& group, const std::vector<double>& mass) {
  double sum = 0;
  for (const std::uint32_t member : group.members) sum += mass[member];
  return sum;
}

// Far from every place that the query may well show: a sample that shows it too would speak for a new place.
std::vector<std::uint32_t> PlaceIndex::Impl::far_samples(const std::vector<Group>& groups,
                                                         const std::vector<double>& mass, const Graph& graph) const {
  if (mass.size() < kOwnSamplesFrom) return {};
  std::unordered_set<FrameId> near;
  for (const Group& group : groups) {
    if (total(group, mass) < kLikelyPlace) continue;
    const std::vector<FrameId> around = place_neighbours(graph, frame_of(group.best), kFar);
    near.insert(around.begin(), around.end());
  }
  std::vector<std::uint32_t> result;
  const std::shared_lock lock(mutex);
  for (const auto& [hash, place] : sampled)
    if (place < mass.size() && !near.contains(frames[place])) result.push_back(place);
  std::sort(result.begin(), result.end());
  return result;
}

PlaceIndex::PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary, PlaceIndexOptions options)
    : impl_(std::make_unique<Impl>(std::move(vocabulary), std::move(options))) {}

PlaceIndex::~PlaceIndex() = default;

Status PlaceIndex::add(FrameId frame, std::span<const std::uint32_t> words) {
  if (impl_->numbers.find(frame) != PlaceNumbers::kNone) return {};
  const std::vector<std::uint32_t> unique = sorted_unique(words);
  if (Status status = impl_->make_room(); !status.ok()) {
    ++impl_->left_out;
    return status;
  }
  const std::unique_lock lock(impl_->mutex);
  const std::uint32_t place = impl_->places.add(unique);
  impl_->numbers.set(frame, place);
  auto& frames = impl_->frames;
  if (frames.size() == frames.capacity())
    frames.reserve(frames.size() + std::max<std::size_t>(1024, frames.size() / 8));
  frames.push_back(frame);
  auto& sampled = impl_->sampled;
  sampled.emplace_back(detail::mix(frame.packed()), place);
  std::push_heap(sampled.begin(), sampled.end());
  if (sampled.size() > kOwnSamples) {
    std::pop_heap(sampled.begin(), sampled.end());
    sampled.pop_back();
  }
  return {};
}

PlaceAnswer PlaceIndex::query(std::span<const std::uint32_t> words, const Graph& graph,
                              const std::function<bool(FrameId)>& masked) const {
  const std::vector<std::uint32_t> unique = sorted_unique(words);
  if (unique.empty()) return {};
  const std::vector<TouchedWord> touched = impl_->model.touched_by(unique);

  const std::lock_guard one_at_a_time(impl_->query_mutex);
  std::vector<double> places;
  std::vector<bool> left_out;
  {
    const std::shared_lock lock(impl_->mutex);
    places = impl_->places.log_likelihoods(touched);
    left_out.resize(places.size());
    if (masked)
      for (std::size_t i = 0; i < places.size(); ++i) left_out[i] = masked(impl_->frames[i]);
  }
  std::vector<double> unknown = impl_->samples.log_likelihoods(touched);
  Posterior posterior = place_posterior(places, left_out, unknown);
  const std::vector<Group> groups = impl_->group(posterior.places, graph);

  const std::vector<std::uint32_t> far = impl_->far_samples(groups, posterior.places, graph);
  for (const std::uint32_t place : far)
    if (!left_out[place]) unknown.push_back(places[place]);
  if (!far.empty()) posterior = place_posterior(places, left_out, unknown);

  PlaceAnswer answer;
  answer.new_place = posterior.new_place;
  for (const Group& group : groups) {
    const double mass = total(group, posterior.places);
    if (mass >= kMinProbability) answer.candidates.push_back({impl_->frame_of(group.best), mass});
  }
  std::sort(answer.candidates.begin(), answer.candidates.end(), [](const PlaceCandidate& x, const PlaceCandidate& y) {
    return x.probability != y.probability ? x.probability > y.probability : x.frame < y.frame;
  });
  if (answer.candidates.size() > kMaxCandidates) answer.candidates.resize(kMaxCandidates);
  return answer;
}

std::size_t PlaceIndex::size() const {
  const std::shared_lock lock(impl_->mutex);
  return impl_->frames.size();
}

std::size_t PlaceIndex::left_out() const { return impl_->left_out; }

std::size_t PlaceIndex::memory_bytes() const {
  const std::shared_lock lock(impl_->mutex);
  return impl_->memory_bytes();
}

}  // namespace relmap
