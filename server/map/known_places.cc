#include "server/map/known_places.h"

#include <spdlog/spdlog.h>

namespace relmap::map {

void find_open_lookups(const std::set<FrameId>& known, const Replayed& replayed, bool deterministic,
                       LookupQueue& lookups) {
  if (deterministic) {  // every lookup was done before the next keyframe was taken in
    for (const FrameId frame : known) lookups.open(frame);
    if (!replayed.frames.empty() && !replayed.looked_up) lookups.open(replayed.frames.back());
    return;
  }
  std::set<FrameId> open = known;
  open.insert(replayed.frames.begin(), replayed.frames.end());
  for (const FrameId frame : open) lookups.push(frame);
}

Status index_known_places(const storage::MapView& view, const place::Vocabulary& vocabulary, const LookupQueue& lookups,
                          place::PlaceIndex& places, storage::Budget& budget) {
  if (const Status restored = places.restore(view); !restored.ok())
    spdlog::warn("the place index is made again from the map, in part or whole: {}", restored.to_string());
  const auto is_known = [&](FrameId frame) { return places.contains(frame); };
  const Status scanned = view.scan_words(is_known, [&](FrameId frame, std::span<const std::uint32_t> words) {
    if (lookups.is_open(frame)) return;
    if (!words.empty()) return add_place(places, budget, frame, words);
    // After a repair a frame may have lost its words. They are computed again from its features, if it has any.
    const auto cold = view.cold(frame);
    if (cold && !cold->appearance.empty()) add_place(places, budget, frame, vocabulary.words(cold->appearance));
  });
  budget.set(storage::Share::kPlaceIndex, places.memory_bytes());
  return scanned;
}

void add_place(place::PlaceIndex& places, storage::Budget& budget, FrameId frame,
               std::span<const std::uint32_t> words) {
  const Status added = places.add(frame, words);
  if (!added.ok() && places.left_out() == 1)
    spdlog::error("frame {} will not be recognised, and others after it: {}", frame.to_string(), added.to_string());
  budget.set(storage::Share::kPlaceIndex, places.memory_bytes());
}

}  // namespace relmap::map
