#include "server/place/trials.h"

#include <utility>

#include "server/place/place_neighbours.h"

namespace relmap::place {

Trials::Trials(const storage::Graph& graph, const QueryPicture& query, std::uint64_t seed, const Proceed& proceed)
    : graph_(graph), query_(query), seed_(seed), proceed_(proceed) {}

Status Trials::run(std::span<const PlaceCandidate> candidates, const TrialLimits& limits) {
  const std::size_t before = trials_.size();
  for (const PlaceCandidate& candidate : candidates) {
    if (candidate.probability < limits.min_probability || trials_.size() - before == limits.max_trials) break;
    if (const auto found = best(); found && trials_[*found].verified->inliers >= limits.sure_inliers) break;
    if (limits.skip_mono && is_mono_session(graph_, candidate.frame.session)) continue;
    if (Status status = proceed_(); !status.ok()) return status;
    PlaceTrial trial = try_place(graph_, query_, candidate.frame, seed_);
    if (limits.needs_metres && trial.verified.ok() && !storage::is_metric(trial.verified->verification))
      trial.verified = Status(Reason::NOT_STEREO, "recognised at " + candidate.frame.to_string() +
                                                      ", which is of a mono session and gives no metric pose");
    trials_.push_back(std::move(trial));
    candidates_.push_back(candidate);
    ++tried_;
  }
  return {};
}

void Trials::keep_confirmed() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < trials_.size(); ++i) {
    if (!trials_[i].verified.ok()) continue;
    if (kept != i) {
      trials_[kept] = std::move(trials_[i]);
      candidates_[kept] = candidates_[i];
    }
    ++kept;
  }
  trials_.erase(trials_.begin() + static_cast<std::ptrdiff_t>(kept), trials_.end());
  candidates_.resize(kept);
}

}  // namespace relmap::place
