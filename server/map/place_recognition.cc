#include "server/map/place_recognition.h"

#include <spdlog/spdlog.h>

#include <utility>
#include <variant>

namespace relmap::map {

PlaceRecognition::PlaceRecognition(std::shared_ptr<const place::Vocabulary> vocabulary,
                                   std::shared_ptr<storage::Budget> budget, std::string folder, std::size_t threads)
    : vocabulary_(std::move(vocabulary)),
      budget_(std::move(budget)),
      places_(vocabulary_, place::PlaceIndexOptions{budget_->allowance(storage::Share::kPlaceIndex), std::move(folder),
                                                    one_in_four(threads)}) {}

Status PlaceRecognition::load(const storage::MapView& view) {
  if (const Status restored = places_.restore(view); !restored.ok())
    spdlog::warn("the place index is made again from the map, in part or whole: {}", restored.to_string());
  const auto is_known = [&](FrameId frame) { return places_.contains(frame); };
  const Status scanned = view.scan_words(is_known, [&](FrameId frame, std::span<const std::uint32_t> words) {
    if (!words.empty()) return add(frame, words);
    // After a repair a frame may have lost its words. They are computed again from its features, if it has any.
    const auto cold = view.cold(frame);
    if (cold && !cold->appearance.empty()) add(frame, vocabulary_->words(cold->appearance));
  });
  budget_->set(storage::Share::kPlaceIndex, places_.memory_bytes());
  return scanned;
}

std::vector<storage::JournalRecord> PlaceRecognition::look_up(const storage::MapView& view, FrameId frame,
                                                              const LaterFrames& later, const RouteMap& newest) {
  const auto session = view.session(frame.session);
  if (!session || storage::is_going(*session)) return {};  // it is no place any more
  Lookup found = map::look_up(view, places_, pictures_, frame, later, newest);
  count_doubts(frame.session, found);
  return std::move(found.records);
}

void PlaceRecognition::forget(SessionNumber session) {
  doubts_.forget(session);
  places_.leave_out(session);
}

void PlaceRecognition::add(FrameId frame, std::span<const std::uint32_t> words) {
  const Status added = places_.add(frame, words);
  if (!added.ok() && places_.left_out() == 1)
    spdlog::error("frame {} will not be recognised, and others after it: {}", frame.to_string(), added.to_string());
  budget_->set(storage::Share::kPlaceIndex, places_.memory_bytes());
}

void PlaceRecognition::count_doubts(SessionNumber session, const Lookup& found) {
  if (found.contradiction) {
    const auto doubt = doubts_.contradict(session, found.contradiction->with, found.contradiction->what.message());
    if (doubt) spdlog::warn("the calibration of session {} is in doubt: {}", doubt->session, doubt->message);
    return;
  }
  for (const storage::JournalRecord& record : found.records)
    if (const auto* proposal = std::get_if<storage::ClosureProposalRecord>(&record))
      doubts_.confirm(session, proposal->match.session);
}

}  // namespace relmap::map
