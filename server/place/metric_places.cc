#include "server/place/metric_places.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "server/place/place_neighbours.h"

namespace relmap::place {

PlaceAnswer metric_answer(PlaceAnswer answer, const PlaceIndex& places, std::span<const std::uint32_t> words,
                          const storage::Graph& graph, std::span<const storage::FrameRange> masked,
                          std::span<const AppearanceFeature> features) {
  const bool mono = std::any_of(answer.candidates.begin(), answer.candidates.end(), [&](const PlaceCandidate& place) {
    return is_mono_session(graph, place.frame.session);
  });
  if (!mono) return answer;
  std::vector<storage::FrameRange> left_out(masked.begin(), masked.end());
  for (const storage::Session& session : graph.sessions())
    if (!session.header.camera.is_stereo())
      left_out.push_back({session.number, 0, std::numeric_limits<std::uint32_t>::max()});
  return places.query(words, graph, left_out, {}, features);
}

}  // namespace relmap::place
