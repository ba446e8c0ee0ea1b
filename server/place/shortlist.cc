#include "server/place/shortlist.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "server/place/place_neighbours.h"
#include "server/place/posterior.h"

namespace relmap::place {
namespace {

struct Ranked {
  LogLikelihood value;
  std::uint32_t place;
};

// Keeps the best kShortlisted of the places that it is offered.
class Best {
 public:
  explicit Best(const PlaceScores& scores) : scores_(scores) {}

  bool may_take(LogLikelihood value) const { return heap_.size() < kShortlisted || value >= heap_.front().value; }
  void offer(Ranked ranked) {
    const auto before = [&](const Ranked& x, const Ranked& y) { return better(x, y); };
    if (heap_.size() == kShortlisted) {
      if (!better(ranked, heap_.front())) return;
      std::pop_heap(heap_.begin(), heap_.end(), before);
      heap_.pop_back();
    }
    heap_.push_back(ranked);
    std::push_heap(heap_.begin(), heap_.end(), before);
  }
  std::vector<Ranked> sorted() && {
    std::sort(heap_.begin(), heap_.end(), [&](const Ranked& x, const Ranked& y) { return better(x, y); });
    return std::move(heap_);
  }

 private:
  bool better(const Ranked& x, const Ranked& y) const {
    return x.value != y.value ? x.value > y.value : scores_.frame(x.place) < scores_.frame(y.place);
  }
  const PlaceScores& scores_;
  std::vector<Ranked> heap_;  // the worst is in front
};

// Divides places into groups: the likeliest place that is in no group yet forms one with all places near it. Returns
// the number of groups.
std::uint32_t divide(std::vector<ShortlistedPlace>& places, const storage::Graph& graph) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::unordered_map<FrameId, ShortlistedPlace*> by_frame;
  for (ShortlistedPlace& place : places) {
    place.group = kNone;
    by_frame.emplace(place.frame, &place);
  }
  std::uint32_t groups = 0;
  for (const ShortlistedPlace& place : places) {
    if (place.group != kNone) continue;
    for (const FrameId frame : place_neighbours(graph, place.frame, kPlaceRadius))
      if (const auto near = by_frame.find(frame); near != by_frame.end() && near->second->group == kNone)
        near->second->group = groups;
    ++groups;
  }
  return groups;
}

}  // namespace

Shortlist shortlist(const PlaceScores& scores, std::span<const std::uint32_t> expected, const storage::Graph& graph) {
  Shortlist result;
  result.candidates = scores.candidates;
  result.expected = expected.size();
  const PlacePriors priors(scores.candidates, expected.size());
  const std::unordered_set<std::uint32_t> is_expected(expected.begin(), expected.end());
  Best best(scores);
  for (const std::uint32_t place : expected) {
    const double likelier = std::log((priors.place + priors.expected) / priors.place);
    best.offer({scores.values[place] + std::llround(likelier * kNat), place});
  }
  for (std::size_t block = 0; block < scores.highest.size(); ++block) {
    if (!best.may_take(scores.highest[block])) continue;
    const auto values = scores.of_block(block);
    for (std::uint32_t i = 0; i < values.size(); ++i) {
      if (values[i] == kLeftOut || !best.may_take(values[i])) continue;
      const auto place = static_cast<std::uint32_t>(block * kPlacesPerBlock) + i;
      if (!is_expected.contains(place)) best.offer({values[i], place});
    }
  }
  for (const Ranked& ranked : std::move(best).sorted())
    result.places.push_back({scores.frame(ranked.place), is_expected.contains(ranked.place), 0});
  result.groups = divide(result.places, graph);
  return result;
}

}  // namespace relmap::place
