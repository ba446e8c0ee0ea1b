// Which places of the map could a picture show? FAB-MAP over inverted lists (docs/method.md, 7), and then descriptors.
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
  double probability = 0;  // mass of the place: summed over its graph neighbours (5 edges)
};

inline constexpr std::size_t kMaxCandidates = 20;
inline constexpr double kMinProbability = 1e-3;
// A place whose best frame holds less than this cannot reach kMinProbability with its neighbours.
inline constexpr double kMinSeed = kMinProbability / 100;

struct PlaceAnswer {
  std::vector<PlaceCandidate> candidates;  // descending; at least kMinProbability each, at most kMaxCandidates
  double new_place = 1;                    // probability that the map does not hold the place
};

struct PlaceIndexOptions {
  // Bytes of memory. Blocks of places beyond it stand in the folder only, and are read by each query; some 9 bytes a
  // place stay.
  std::size_t allowance = std::numeric_limits<std::size_t>::max();
  // The data folder, where DIR/places keeps the index from one start to the next. Empty: it stands in memory only.
  std::string folder;
};

// The best kMaxCandidates, of equals that of the first frame.
void most_probable_first(std::vector<PlaceCandidate>& candidates);

// Thread-safe: one writer, any number of readers. Queries are answered one at a time, beside the writer: each holds
// memory in proportion to the number of places.
class PlaceIndex {
 public:
  explicit PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary, PlaceIndexOptions options = {});
  ~PlaceIndex();

  // Before the first add(): the places that the folder keeps and `map` holds, or held in sessions being deleted. Not
  // ok: why some could not be used and are to be added again (IO_ERROR, DATA_LOSS, TRUNCATED, CORRUPT,
  // WRONG_VOCABULARY, UNKNOWN_FORMAT_VERSION, NO_SUCH_FRAME: the map has lost some).
  Status restore(const storage::Graph& map);
  // All places into the folder. IO_ERROR, DISK_FULL: those that are missing there are to be added at the next start.
  Status save();

  // Places are added in any order; one that is there already stays as it is. `words` need not be sorted or unique;
  // without any it is no place, since nothing could be recognised there.
  // IO_ERROR, DISK_FULL (the disk takes nothing), BUDGET_EXCEEDED: the place is left out, and counted by left_out().
  Status add(FrameId frame, std::span<const std::uint32_t> words);
  bool contains(FrameId frame) const;  // for the writer

  // No place of this session is recognised any more. What the index holds of it stays until it is made anew.
  void leave_out(SessionNumber session);

  // `masked`: left out as candidates and from the sum (the query's own recent past). `near`: where the query is thought
  // to be; places up to kExpectedRadius edges around it share half of the prior. `graph` gives neighbours. `features`:
  // of the words, one each. The places that words make likeliest are compared with them feature by feature, which needs
  // what the graph knows of these places (shortlist.h, compare_places.h); without features, and among a few places,
  // words alone tell. The same places and the same query give the same answer bit for bit, in whatever order they came
  // and wherever they stand. Throws StatusError where reads of the graph do, or of what is on disk.
  PlaceAnswer query(std::span<const std::uint32_t> words, const storage::Graph& graph,
                    std::span<const storage::FrameRange> masked = {}, std::optional<FrameId> near = {},
                    std::span<const AppearanceFeature> features = {}) const;

  std::size_t size() const;
  std::size_t left_out() const;
  std::size_t memory_bytes() const;  // with a query under way

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::place
