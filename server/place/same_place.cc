#include "server/place/same_place.h"

#include <algorithm>

#include "server/place/place_neighbours.h"

namespace relmap::place {

bool same_photograph(const storage::Graph& graph, FrameId a, FrameId b) {
  if (a.session == b.session) return false;
  const auto hot_a = graph.hot(a), hot_b = graph.hot(b);  // the features may have to be read from disk
  if (!hot_a || !hot_b || hot_a->appearance_count != hot_b->appearance_count) return false;
  if (!is_mono_session(graph, a.session) || !is_mono_session(graph, b.session)) return false;
  const auto cold_a = graph.cold(a), cold_b = graph.cold(b);
  return cold_a && cold_b && !cold_a->appearance.empty() &&
         std::equal(cold_a->appearance.begin(), cold_a->appearance.end(), cold_b->appearance.begin(),
                    cold_b->appearance.end(), [](const AppearanceFeature& x, const AppearanceFeature& y) {
                      return x.u == y.u && x.v == y.v && x.descriptor == y.descriptor;
                    });
}

bool has_photograph(const storage::Graph& graph, std::span<const storage::FrameRange> frames, FrameId frame) {
  return is_mono_session(graph, frame.session) &&
         std::any_of(frames.begin(), frames.end(), [&](const storage::FrameRange& range) {
           for (std::uint32_t index = range.first; index <= range.last; ++index)
             if (same_photograph(graph, frame, {range.session, index})) return true;
           return false;
         });
}

}  // namespace relmap::place
