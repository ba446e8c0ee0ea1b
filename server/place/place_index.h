// Finds the places of the map that a picture may show: by FAB-MAP over inverted lists (docs/method.md, 7), and then by
// descriptors.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "server/place/vocabulary.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::place {

inline constexpr std::uint32_t kExpectedRadius = 12;

struct PlaceCandidate {
  FrameId frame;           // the best frame of the place
  double probability = 0;  // of the place: the sum over the frames within 5 edges (kPlaceRadius)
};

inline constexpr std::size_t kMaxCandidates = 20;
inline constexpr double kMinProbability = 1e-3;
// Frames below this probability are not tried as the best frame of a place: with its neighbours such a place would not
// reach kMinProbability.
inline constexpr double kMinSeed = kMinProbability / 100;

struct PlaceAnswer {
  std::vector<PlaceCandidate> candidates;  // at most kMaxCandidates, descending, each at least kMinProbability
  double new_place = 1;                    // probability that the map does not hold the place
};

struct PlaceIndexOptions {
  // Bytes of memory. Blocks of places for which it has no room are kept in the folder only, and are read by each query;
  // about 9 bytes a place stay in memory.
  std::size_t allowance = std::numeric_limits<std::size_t>::max();
  // The data folder, where DIR/places keeps the index from one start to the next. Empty: the index is in memory only.
  std::string folder;
  // Queries at the same time, at most; others wait. The allowance keeps room for all of them: each needs memory in
  // proportion to the number of places.
  std::size_t queries = 1;
};

// Sorts by descending probability (equal ones by frame) and keeps the first kMaxCandidates.
void most_probable_first(std::vector<PlaceCandidate>& candidates);

// Thread-safe for one writer and any number of readers.
class PlaceIndex {
 public:
  explicit PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary, PlaceIndexOptions options = {});
  ~PlaceIndex();

  // Loads the places in the folder that `map` holds, or that belong to sessions being deleted. Call it before the first
  // add(). If the status is not ok, it says why some places could not be used, and the caller must add them again:
  // IO_ERROR, DATA_LOSS, TRUNCATED, CORRUPT, WRONG_VOCABULARY, UNKNOWN_FORMAT_VERSION, NO_SUCH_FRAME (the map has lost
  // some of the frames).
  Status restore(const storage::Graph& map);
  // Writes all places to the folder. IO_ERROR, DISK_FULL: the places that are missing there must be added again after
  // the next start.
  Status save();

  // Adds a place; places may come in any order. Does nothing if the index has the frame already, or if there are no
  // words, since nothing could be recognised there. `words` need not be sorted or unique. IO_ERROR, DISK_FULL and
  // BUDGET_EXCEEDED: the place is left out and counted by left_out().
  Status add(FrameId frame, std::span<const std::uint32_t> words);
  bool contains(FrameId frame) const;  // may be called by the writer only

  // Excludes all places of a session from answers. They stay in the index until it is made anew.
  void leave_out(SessionNumber session);

  // Returns the places that a picture with these words may show. Frames within `masked` (the query's own recent past)
  // are no candidates and do not count in the normalisation. `near` is a frame near which the query is thought to be:
  // places up to kExpectedRadius edges around it share half of the prior. `graph` gives the neighbours of places.
  // `features` are empty, or the features of the words, one each: the places that are likeliest by words are then
  // compared feature by feature (shortlist.h, compare_places.h). Without features, and among few places, words alone
  // decide.
  //
  // The answer depends only on the places and the query, bit for bit, not on the order in which places were added or on
  // where they are stored. Throws StatusError where reads of the graph or the disk do.
  PlaceAnswer query(std::span<const std::uint32_t> words, const storage::Graph& graph,
                    std::span<const storage::FrameRange> masked = {}, std::optional<FrameId> near = {},
                    std::span<const AppearanceFeature> features = {}) const;

  // Returns what query() finds by words alone, in half of the time: words of which the picture shows only the parent do
  // not count (BlockScores::Counts::kShown). For callers that do not need exact probabilities.
  std::vector<PlaceCandidate> by_shown_words(std::span<const std::uint32_t> words, const storage::Graph& graph,
                                             std::span<const storage::FrameRange> masked) const;

  std::size_t size() const;          // places
  std::size_t left_out() const;      // places for which there was no room
  std::size_t memory_bytes() const;  // including that of as many queries as may run

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// For callers that need a metric pose, so that photographs of the same places do not compete. Returns `answer`, which
// PlaceIndex::query() gave to the same question, if no candidate is of a mono session. Otherwise asks again without
// mono sessions, so that their frames take no probability and no room from the others.
PlaceAnswer metric_answer(PlaceAnswer answer, const PlaceIndex& places, std::span<const std::uint32_t> words,
                          const storage::Graph& graph, std::span<const storage::FrameRange> masked,
                          std::span<const AppearanceFeature> features);

}  // namespace relmap::place
