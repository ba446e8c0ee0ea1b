#include "server/place/uniqueness.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "server/place/place_neighbours.h"
#include "server/place/same_place.h"

namespace relmap::place {
namespace {

constexpr std::uint32_t kPlaceEdges = 20;
constexpr double kSameDiffers = 0.1;  // the largest differing_share() of two views of one place

bool metric(const PlaceTrial& trial) { return trial.verified.ok() && storage::is_metric(trial.verified->verification); }

// Whether `other` is the place of `known`, passed at another time and not joined to it. `known` must be metric.
bool seen_twice(const storage::Graph& graph, const PlaceTrial& known, const PlaceTrial& other, std::uint64_t seed) {
  const auto cold = graph.cold(other.frame);
  const auto session = graph.session(other.frame.session);
  if (!cold || !session) return false;
  const QueryPicture from_other = query_of(*cold, session->header.camera);
  const auto seen = verify_place(graph, from_other, known.frame, seed);
  if (seen.reason() == Reason::WRONG_CALIBRATION) return true;  // the same place, seen by different cameras
  if (!seen.ok() || 2 * seen->inliers < known.verified->inliers) return false;
  if (const float differs = differing_share(graph, from_other, *seen); differs < 0 || differs > kSameDiffers)
    return false;
  if (!metric(other)) return true;
  const auto to_seen = way_beside(graph, known.frame, seen->match, kViewReach);
  if (!to_seen) return false;
  return says_the_same(known.verified->T_match_query.inverse() * *to_seen * seen->T_match_query *
                       other.verified->T_match_query);
}

// Numbers the places of the trials; trials of one place have one number, and the best's is 0.
std::vector<std::uint32_t> places_of(const storage::Graph& graph, std::span<const PlaceTrial> trials, std::size_t best,
                                     std::uint64_t seed) {
  std::vector<std::vector<storage::FrameRange>> places{place_ranges(graph, trials[best].frame)};
  std::vector<std::uint32_t> place;
  for (const PlaceTrial& trial : trials) {
    const auto known = std::find_if(places.begin(), places.end(), [&](const auto& ranges) {
      return storage::within(trial.frame, ranges) || has_photograph(graph, ranges, trial.frame);
    });
    place.push_back(static_cast<std::uint32_t>(known - places.begin()));
    if (known != places.end()) continue;
    // Without a metric pose the two cannot be told to be one place.
    const bool told = trial.verified.ok() && (metric(trials[best]) || metric(trial));
    if (told && (metric(trials[best]) ? seen_twice(graph, trials[best], trial, seed)
                                      : seen_twice(graph, trial, trials[best], seed)))
      place.back() = 0;
    else
      places.push_back(place_ranges(graph, trial.frame));
  }
  return place;
}

}  // namespace

std::vector<storage::FrameRange> place_ranges(const storage::Graph& graph, FrameId frame) {
  std::vector<storage::FrameRange> ranges;
  for (const FrameId near : place_neighbours_driven(graph, frame, kPlaceEdges))
    ranges.push_back({near.session, near.index, near.index});
  return ranges;
}

std::optional<std::size_t> best_of(std::span<const PlaceTrial> trials) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < trials.size(); ++i)
    if (trials[i].verified.ok() && (!best || trials[i].verified->inliers > trials[*best].verified->inliers)) best = i;
  return best;
}

namespace {

// Weighs how well each trial's place explains the query, apart from places that were dismissed.
class Weighing {
 public:
  Weighing(std::span<const PlaceTrial> trials, std::size_t best, std::span<const std::uint32_t> place)
      : trials_(trials), best_(best), place_(place) {}

  void dismiss(std::uint32_t place) { dismissed_.insert(place); }

  void find_runner_up(Standing& standing) const {
    std::map<std::uint32_t, std::vector<std::uint32_t>> fits_at;  // the places at which a feature fits, each once
    for (std::size_t i = 0; i < trials_.size(); ++i)
      if (counts(i))
        for (const std::uint32_t feature : trials_[i].features)
          if (auto& at = fits_at[feature]; std::find(at.begin(), at.end(), place_[i]) == at.end())
            at.push_back(place_[i]);
    const auto weight_of = [&](const PlaceTrial& trial) {
      double weight = 0;
      for (const std::uint32_t feature : trial.features) weight += 1 / static_cast<double>(fits_at[feature].size());
      return weight;
    };
    double max_weight = 0;
    std::set<std::uint32_t> confirmed;
    standing.runner_up.reset();
    for (std::size_t i = 0; i < trials_.size(); ++i) {
      if (place_[i] == 0) continue;
      if (trials_[i].verified.ok()) confirmed.insert(place_[i]);  // even if it has been dismissed
      if (!counts(i)) continue;
      if (const double weight = weight_of(trials_[i]); weight > max_weight) {
        max_weight = weight;
        standing.runner_up = i;
      }
    }
    storage::Uniqueness& uniqueness = standing.uniqueness;
    uniqueness.alike = static_cast<std::uint16_t>(confirmed.size());
    uniqueness.runner_up = standing.runner_up ? trials_[*standing.runner_up].frame : FrameId();
    const double inliers = trials_[best_].verified->inliers;
    uniqueness.runner_up_inliers = max_weight == 0
                                       ? std::uint16_t{0}
                                       : static_cast<std::uint16_t>(std::min(
                                             65535.0, std::round(inliers * max_weight / weight_of(trials_[best_]))));
  }

 private:
  // A place whose camera contradicts the query's is no rival: as a rule it is the same place.
  bool counts(std::size_t trial) const {
    return !dismissed_.contains(place_[trial]) && !is_contradicted(trials_[trial]);
  }

  std::span<const PlaceTrial> trials_;
  std::size_t best_;
  std::span<const std::uint32_t> place_;  // the number of each trial's place; 0 is the best's
  std::set<std::uint32_t> dismissed_;
};

}  // namespace

std::optional<Standing> weigh(const storage::Graph& graph, const QueryPicture& query,
                              std::span<const PlaceTrial> trials, std::size_t answers, std::uint64_t seed,
                              const ComparePlace& compare) {
  const auto found = best_of(trials.first(answers));
  if (!found) return std::nullopt;
  std::optional<Standing> standing(std::in_place);
  standing->best = *found;
  const PlaceTrial& best = trials[standing->best];
  const auto place = places_of(graph, trials, standing->best, seed);
  for (const std::uint32_t number : place) standing->at_best.push_back(number == 0);
  standing->uniqueness.known = true;
  standing->uniqueness.differs = differing_share(graph, query, *best.verified);

  Weighing weighing(trials, standing->best, place);
  weighing.find_runner_up(*standing);
  for (std::optional<Changes> at_best; compare && metric(best);) {
    if (!is_ambiguous(standing->uniqueness, best.verified->inliers)) break;
    const std::size_t rival = *standing->runner_up;
    if (!metric(trials[rival])) break;
    if (!at_best) at_best = compare(*best.verified);
    if (!told_apart(*at_best, compare(*trials[rival].verified))) break;
    weighing.dismiss(place[rival]);
    weighing.find_runner_up(*standing);
  }
  return standing;
}

std::vector<PlaceCandidate> look_alikes(const storage::Graph& graph, const PlaceIndex& places, FrameId frame,
                                        std::span<const storage::FrameRange> masked) {
  const auto cold = graph.cold(frame);
  if (!cold || cold->words.empty()) return {};
  std::vector<storage::FrameRange> left_out = place_ranges(graph, frame);
  left_out.insert(left_out.end(), masked.begin(), masked.end());
  return places.by_shown_words(cold->words, graph, left_out);
}

bool is_ambiguous(const storage::Uniqueness& uniqueness, std::uint32_t inliers) {
  return uniqueness.known && uniqueness.runner_up.valid() && uniqueness.runner_up_inliers > kAlike * inliers;
}

}  // namespace relmap::place
