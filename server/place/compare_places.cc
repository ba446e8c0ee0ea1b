#include "server/place/compare_places.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <unordered_map>

#include "server/place/place_neighbours.h"
#include "server/place/posterior.h"

namespace relmap::place {
namespace {

// Null if the features are lost or there are none.
std::shared_ptr<const storage::FrameCold> features_of(const storage::Graph& graph, FrameId frame) {
  try {
    auto cold = graph.cold(frame);
    return cold && cold->words.size() == cold->appearance.size() ? cold : nullptr;
  } catch (const StatusError& error) {
    if (error.status().reason() != Reason::DATA_LOSS) throw;
    return nullptr;
  }
}

std::vector<double> likeness_of(const DescribedWords& query, const Shortlist& shortlist, const storage::Graph& graph) {
  std::vector<std::shared_ptr<const storage::FrameCold>> read;
  std::vector<DescribedWords> places;
  std::vector<std::uint32_t> groups;
  for (const ShortlistedPlace& place : shortlist.places) {
    read.push_back(features_of(graph, place.frame));
    places.push_back(read.back() ? DescribedWords{read.back()->appearance, read.back()->words} : DescribedWords{});
    groups.push_back(place.group);
  }
  return likeness(query, places, groups);
}

// Returns the posterior of each shortlisted place and sets `new_place` to the probability that the map does not hold
// the place. Places that are not on the list have likeness 0.
std::vector<double> posterior_of(const Shortlist& shortlist, const std::vector<double>& likeness, double& new_place) {
  const PlacePriors priors(shortlist.candidates, shortlist.expected);
  const auto weight = [](double prior, double like) { return prior * std::exp(log_likelihood_ratio(like)); };
  std::vector<double> masses;
  std::size_t expected = 0;
  for (std::size_t i = 0; i < likeness.size(); ++i) {
    const bool here = shortlist.places[i].expected;
    expected += here;
    masses.push_back(weight(priors.place + (here ? priors.expected : 0), likeness[i]));
  }
  const double others = weight(priors.place * static_cast<double>(shortlist.candidates - likeness.size()) +
                                   priors.expected * static_cast<double>(shortlist.expected - expected),
                               0);
  const double sum = std::accumulate(masses.begin(), masses.end(), priors.new_place + others);
  for (double& mass : masses) mass /= sum;
  new_place = priors.new_place / sum;
  return masses;
}

}  // namespace

PlaceAnswer compare_places(const DescribedWords& query, const Shortlist& shortlist, const storage::Graph& graph) {
  PlaceAnswer answer;
  const std::vector<double> likeness = likeness_of(query, shortlist, graph);
  const std::vector<double> masses = posterior_of(shortlist, likeness, answer.new_place);

  // Greedy grouping, best frame first: a frame belongs to the first place that reaches it.
  std::vector<std::size_t> order(masses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) {
    if (masses[x] != masses[y]) return masses[x] > masses[y];
    return likeness[x] != likeness[y] ? likeness[x] > likeness[y]
                                      : shortlist.places[x].frame < shortlist.places[y].frame;
  });
  std::unordered_map<FrameId, double> unclaimed;
  for (const std::size_t i : order) unclaimed.emplace(shortlist.places[i].frame, masses[i]);
  for (const std::size_t i : order) {
    const FrameId best = shortlist.places[i].frame;
    if (masses[i] < kMinSeed) break;
    if (!unclaimed.contains(best)) continue;
    PlaceCandidate candidate{best, 0};
    for (const FrameId frame : place_neighbours(graph, best, kPlaceRadius))
      if (const auto member = unclaimed.extract(frame)) candidate.probability += member.mapped();
    if (candidate.probability >= kMinProbability) answer.candidates.push_back(candidate);
  }
  most_probable_first(answer.candidates);
  return answer;
}

}  // namespace relmap::place
