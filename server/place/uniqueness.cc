#include "server/place/uniqueness.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "server/place/differs.h"
#include "server/place/map_points.h"
#include "server/place/place_neighbours.h"

namespace relmap {
namespace {

constexpr std::uint32_t kPlaceEdges = 20;
constexpr double kSameMetres = 0.5;  // two ways to one place may differ by so much
constexpr double kSameRadians = 0.17;
constexpr double kSameDiffers = 0.1;  // of two views of one place, at most

bool metric(const PlaceTrial& trial) { return trial.verified.ok() && is_metric(trial.verified->verification); }

// Of one pass: T_a_b along the odometry.
std::optional<SE3> way(const Graph& graph, FrameId a, FrameId b) {
  for (const PlacedFrame& placed : along_odometry(graph, a, kViewReach, kViewReach))
    if (placed.frame == b) return placed.T_centre_frame;
  return std::nullopt;
}

// Whether a rival is the best place itself, passed another time and never joined to it.
bool seen_twice(const Graph& graph, const PlaceTrial& best, const PlaceTrial& rival, std::uint64_t seed) {
  const auto cold = graph.cold(rival.frame);
  const auto session = graph.session(rival.frame.session);
  if (!cold || !session || !rival.verified.ok()) return false;
  const QueryPicture from_rival{cold->appearance, session->header.camera, {}};
  const auto seen = verify_place(graph, from_rival, best.frame, seed);
  if (!seen.ok()) return false;
  if (!metric(best) || !metric(rival)) return seen->inliers >= best.verified->inliers;
  const auto to_seen = way(graph, best.frame, seen->match);
  if (!to_seen) return false;
  const SE3 off =
      best.verified->T_match_query.inverse() * *to_seen * seen->T_match_query * rival.verified->T_match_query;
  return off.t.norm() <= kSameMetres && rotation_angle(off.R) <= kSameRadians &&
         2 * seen->inliers >= best.verified->inliers && differing_share(graph, from_rival, *seen) <= kSameDiffers;
}

// Which trials are of one place: numbers of places, the best's is 0.
std::vector<std::uint32_t> places_of(const Graph& graph, std::span<const PlaceTrial> trials, std::size_t best,
                                     std::uint64_t seed) {
  std::vector<std::vector<FrameRange>> places{place_ranges(graph, trials[best].frame)};
  std::vector<std::uint32_t> place;
  for (const PlaceTrial& trial : trials) {
    const auto known =
        std::find_if(places.begin(), places.end(), [&](const auto& ranges) { return within(trial.frame, ranges); });
    place.push_back(static_cast<std::uint32_t>(known - places.begin()));
    if (known != places.end()) continue;
    if (seen_twice(graph, trials[best], trial, seed))
      place.back() = 0;
    else
      places.push_back(place_ranges(graph, trial.frame));
  }
  return place;
}

}  // namespace

std::vector<FrameRange> place_ranges(const Graph& graph, FrameId frame) {
  std::vector<FrameRange> ranges;
  for (const FrameId near : place_neighbours(graph, frame, kPlaceEdges))
    ranges.push_back({near.session, near.index, near.index});
  return ranges;
}

std::optional<std::size_t> best_of(std::span<const PlaceTrial> trials) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < trials.size(); ++i)
    if (trials[i].verified.ok() && (!best || trials[i].verified->inliers > trials[*best].verified->inliers)) best = i;
  return best;
}

std::optional<Standing> weigh(const Graph& graph, const QueryPicture& query, std::span<const PlaceTrial> trials,
                              std::size_t answers, std::uint64_t seed) {
  const auto found = best_of(trials.first(answers));
  if (!found) return std::nullopt;
  std::optional<Standing> standing(std::in_place);
  standing->best = *found;
  const PlaceTrial& best = trials[standing->best];
  const auto place = places_of(graph, trials, standing->best, seed);

  std::map<std::uint32_t, std::vector<std::uint32_t>> fits_at;  // places of a feature, each once
  for (std::size_t i = 0; i < trials.size(); ++i)
    for (const std::uint32_t feature : trials[i].features)
      if (auto& at = fits_at[feature]; std::find(at.begin(), at.end(), place[i]) == at.end()) at.push_back(place[i]);
  const auto weight_of = [&](const PlaceTrial& trial) {
    double weight = 0;
    for (const std::uint32_t feature : trial.features) weight += 1 / static_cast<double>(fits_at[feature].size());
    return weight;
  };

  double most = 0;
  std::vector<std::uint32_t> confirmed;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (place[i] == 0) continue;
    if (trials[i].verified.ok() && std::find(confirmed.begin(), confirmed.end(), place[i]) == confirmed.end())
      confirmed.push_back(place[i]);
    if (const double weight = weight_of(trials[i]); weight > most) {
      most = weight;
      standing->runner_up = i;
    }
  }
  for (const std::uint32_t number : place) standing->at_best.push_back(number == 0);
  Uniqueness& uniqueness = standing->uniqueness;
  uniqueness.known = true;
  uniqueness.alike = static_cast<std::uint16_t>(confirmed.size());
  uniqueness.differs = differing_share(graph, query, *best.verified);
  if (standing->runner_up) {
    uniqueness.runner_up = trials[*standing->runner_up].frame;
    uniqueness.runner_up_inliers =
        static_cast<std::uint16_t>(std::min(65535.0, std::round(best.verified->inliers * most / weight_of(best))));
  }
  return standing;
}

std::vector<PlaceCandidate> look_alikes(const Graph& graph, const PlaceIndex& places, FrameId frame,
                                        std::span<const FrameRange> masked) {
  const auto cold = graph.cold(frame);
  if (!cold || cold->words.empty()) return {};
  std::vector<FrameRange> left_out = place_ranges(graph, frame);
  left_out.insert(left_out.end(), masked.begin(), masked.end());
  return places.query(cold->words, graph, left_out).candidates;
}

bool is_ambiguous(const Uniqueness& uniqueness, std::uint32_t inliers) {
  return uniqueness.known && uniqueness.runner_up.valid() && uniqueness.runner_up_inliers > kAlike * inliers;
}

}  // namespace relmap
