// Verifies the place candidates of one picture by geometry, one after another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "server/place/mirrored.h"
#include "server/place/place_index.h"
#include "server/place/uniqueness.h"
#include "server/place/verify.h"
#include "storage/graph/graph.h"

namespace relmap::place {

// Called before each candidate is verified, and now and then in other work. A status that is not ok (DEADLINE,
// SHUTTING_DOWN) ends the work with that status. Must not be empty.
using Proceed = std::function<Status()>;

// Which candidates a run tries.
struct TrialLimits {
  std::size_t max_trials = std::numeric_limits<std::size_t>::max();
  double min_probability = 0;  // the first candidate below this ends the run
  std::uint32_t sure_inliers = std::numeric_limits<std::uint32_t>::max();  // a place with so many or more ends the run
  bool skip_mono = false;     // pass over candidates of mono sessions, which have no metric scale
  bool needs_metres = false;  // refuse a confirmed place without metric scale (NOT_STEREO)
};

// Not thread-safe.
class Trials {
 public:
  // `graph`, `proceed` and what `query` refers to must outlive this. `seed` is that of RANSAC.
  Trials(const storage::Graph& graph, const QueryPicture& query, std::uint64_t seed, const Proceed& proceed);

  // Tries the candidates in their order. Returns the status of `proceed` if it is not ok.
  Status run(std::span<const PlaceCandidate> candidates, const TrialLimits& limits);

  // Drops the trials that geometry does not confirm.
  void keep_confirmed();

  const QueryPicture& query() const { return query_; }
  const std::vector<PlaceTrial>& all() const { return trials_; }
  // The candidate of a trial. (The trial's own frame is the one in which most of the picture fits.)
  const PlaceCandidate& candidate(std::size_t trial) const { return candidates_[trial]; }
  std::size_t size() const { return trials_.size(); }
  std::size_t tried() const { return tried_; }  // including trials dropped since

  // The functions of these names in uniqueness.h, for the trials.
  std::optional<std::size_t> best() const { return best_of(trials_); }
  std::optional<Standing> weigh(std::size_t answers, const ComparePlace& compare = {}) const {
    return place::weigh(graph_, query_, trials_, answers, seed_, compare);
  }
  // The function of this name in mirrored.h, for the picture.
  Status check_not_mirrored(const VerifiedPlace& found) const {
    return place::check_not_mirrored(graph_, query_, found, seed_);
  }

 private:
  const storage::Graph& graph_;
  const QueryPicture query_;
  const std::uint64_t seed_;
  const Proceed& proceed_;
  std::vector<PlaceTrial> trials_;
  std::vector<PlaceCandidate> candidates_;  // one for each of trials_
  std::size_t tried_ = 0;
};

}  // namespace relmap::place
