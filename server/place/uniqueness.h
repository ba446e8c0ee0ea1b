// Verified means unique: of the places that explain a picture, does one stand out? Where floors look alike geometry
// confirms several of them, the wrong ones too (docs/method.md, 7).
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

// A runner-up with more than this share of what speaks for the best makes it ambiguous.
inline constexpr double kAlike = 0.5;

struct Standing {
  std::size_t best = 0;                  // of the trials: where most fits, of those that geometry confirms
  std::optional<std::size_t> runner_up;  // elsewhere
  std::vector<bool> at_best;             // of the trials: whether of the best's place
  // `runner_up_inliers` is on the scale of the best's inliers: those times the share that the runner-up has of what
  // speaks for the best, which what fits at several places does less: a feature that fits at n of them counts 1/n.
  storage::Uniqueness uniqueness;
};

// Of trials that geometry confirms the one where most fits: the first of several.
std::optional<std::size_t> best_of(std::span<const PlaceTrial> trials);

// What of a place, verified in metres, the query's picture shows changed.
using ComparePlace = std::function<Changes(const VerifiedPlace& place)>;

// Nothing where geometry confirms none of the first `answers` trials; one of these is the best. Of `trials` of one
// query those at the place of the best (place_ranges()) are no rivals, nor is one that was never joined to it and yet
// is the same place: from there the best is confirmed, with half its inliers at least, where both say that it is, and
// next to nothing differs. Of two mono sessions, which have no metres, nothing tells but that they are of the same
// photographs. `differs` is measured where there is a pose. A rival that would make the best ambiguous is compared by
// `compare`, if that is given: one that is told apart from the best (told_apart()) counts no more than a place where
// nothing fits.
std::optional<Standing> weigh(const storage::Graph& graph, const QueryPicture& query,
                              std::span<const PlaceTrial> trials, std::size_t answers, std::uint64_t seed,
                              const ComparePlace& compare = {});

// A function of what a proposal records; no where nothing is known.
bool is_ambiguous(const storage::Uniqueness& uniqueness, std::uint32_t inliers);

// What looks like `frame` elsewhere in the map, likeliest first, by its own words: places that explain a picture of it,
// too, whether the words of the picture tell so or not. Frames within `masked` are left out.
std::vector<PlaceCandidate> look_alikes(const storage::Graph& graph, const PlaceIndex& places, FrameId frame,
                                        std::span<const storage::FrameRange> masked);

// The frames that show the same place as `frame`, as the graph has it: within 20 edges, or frames of a mono session.
std::vector<storage::FrameRange> place_ranges(const storage::Graph& graph, FrameId frame);

}  // namespace relmap::place
