// Decides whether one of the places that explain a picture stands out. Where floors look alike, geometry confirms
// several of them, the wrong ones too, so a place counts as verified only if it is unique (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "server/place/changes.h"
#include "server/place/place_index.h"
#include "server/place/verify.h"
#include "storage/graph/frame.h"
#include "storage/graph/frame_range.h"

namespace relmap::place {

// The best place is ambiguous if the runner-up has more than this share of its weight.
inline constexpr double kAlike = 0.5;

struct Standing {
  std::size_t best = 0;                  // index of the confirmed trial with the most inliers
  std::optional<std::size_t> runner_up;  // index of the best trial at another place
  std::vector<bool> at_best;             // for each trial, whether it is at the place of the best
  // A trial's weight is the sum over its features, where a feature that fits at n places counts 1/n.
  // `runner_up_inliers` is the number of the best's inliers times the ratio of the runner-up's weight to the best's.
  storage::Uniqueness uniqueness;
};

// The index of the confirmed trial with the most inliers (the first of equal ones); nullopt if none is confirmed.
std::optional<std::size_t> best_of(std::span<const PlaceTrial> trials);

// Compares the query's picture with the landmarks of a place that was verified with a metric pose.
using ComparePlace = std::function<Changes(const VerifiedPlace& place)>;

// Weighs the trials of one query against each other. The best is one of the first `answers` trials; nullopt if geometry
// confirms none of these.
//
// Trials at the place of the best (place_ranges()) are no rivals. Neither is a trial at a place that no edges join to
// the best, if it is the same place. That holds if the best is confirmed from there with at least half of its inliers
// and at the same pose, and hardly any cell differs. Mono sessions have no metric poses, so only the same photographs
// tell that two of them show the same place.
//
// `differs` is measured if the best has a metric pose. If `compare` is given, it is called for the best and for each
// rival that would make the best ambiguous; a rival that it tells apart (told_apart()) is dismissed.
std::optional<Standing> weigh(const storage::Graph& graph, const QueryPicture& query,
                              std::span<const PlaceTrial> trials, std::size_t answers, std::uint64_t seed,
                              const ComparePlace& compare = {});

// Whether a closure with this uniqueness and this number of inliers is ambiguous. Depends only on what a proposal
// records; false if the uniqueness is not known.
bool is_ambiguous(const storage::Uniqueness& uniqueness, std::uint32_t inliers);

// Finds places elsewhere in the map that look like `frame` by the frame's own words, likeliest first. They may explain
// a picture of `frame` too, even if the picture's words do not suggest them. Frames within `masked` are left out.
std::vector<PlaceCandidate> look_alikes(const storage::Graph& graph, const PlaceIndex& places, FrameId frame,
                                        std::span<const storage::FrameRange> masked);

// The frames that show the same place as `frame` according to the graph: those within 20 steps of
// place_neighbours_driven(), one range each.
std::vector<storage::FrameRange> place_ranges(const storage::Graph& graph, FrameId frame);

}  // namespace relmap::place
