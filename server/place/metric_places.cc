#include "server/place/metric_places.h"

#include <limits>
#include <set>
#include <vector>

#include "server/place/place_neighbours.h"

namespace relmap {

namespace {
constexpr int kRounds = 8;  // each leaves out all mono sessions of up to kMaxCandidates
}  // namespace

PlaceAnswer query_metric(const PlaceIndex& places, std::span<const std::uint32_t> words, const Graph& graph,
                         std::span<const FrameRange> masked, std::span<const AppearanceFeature> features) {
  std::vector<FrameRange> left_out(masked.begin(), masked.end());
  for (int round = 0;; ++round) {
    PlaceAnswer answer = places.query(words, graph, left_out, {}, features);
    std::set<SessionNumber> mono;
    for (const PlaceCandidate& candidate : answer.candidates)
      if (is_mono_session(graph, candidate.frame.session)) mono.insert(candidate.frame.session);
    if (mono.empty() || round == kRounds) {
      std::erase_if(answer.candidates, [&](const PlaceCandidate& c) { return mono.contains(c.frame.session); });
      return answer;
    }
    for (const SessionNumber session : mono)
      left_out.push_back({session, 0, std::numeric_limits<std::uint32_t>::max()});
  }
}

}  // namespace relmap
