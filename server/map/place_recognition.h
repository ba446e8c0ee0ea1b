// Recognises places in keyframes: looks each frame up among those before it, then makes it a place itself.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "server/map/camera_doubts.h"
#include "server/map/lookup.h"
#include "server/map/lookup_queue.h"
#include "server/place/picture_cache.h"
#include "server/place/place_index.h"
#include "server/place/vocabulary.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// Thread-safe, but look_up() is called by one thread at a time.
class PlaceRecognition {
 public:
  // `folder`: the map's, in which the place index keeps its file.
  PlaceRecognition(std::shared_ptr<const place::Vocabulary> vocabulary, std::shared_ptr<storage::Budget> budget,
                   std::string folder);

  // Makes a place of every frame with words: from the index's folder, or else from the map. Frames whose lookup is open
  // are left out; they become places when they are looked up. IO_ERROR, DATA_LOSS, VIEW_EXPIRED: the words could not
  // all be read, so some places would silently not be recognised.
  Status load(const storage::MapView& view, const LookupQueue& lookups);

  // Looks the frame up, notes which calibrations it contradicts or confirms, and makes it a place. Returns the records
  // of what was found. Throws StatusError; the frame is a place then too.
  std::vector<storage::JournalRecord> look_up(const storage::MapView& view, FrameId frame);

  // The session is being deleted: its frames are places no more.
  void forget(SessionNumber session);

  // Keeps the places in the folder, so that the next load() need not read the map.
  Status save() { return places_.save(); }

  const place::PlaceIndex& places() const { return places_; }
  std::vector<CameraDoubt> doubts() const { return doubts_.doubts(); }

 private:
  // Charges the index's memory to the budget. The first place for which there is no room is logged.
  void add_place(FrameId frame, std::span<const std::uint32_t> words);
  void count_doubts(SessionNumber session, const Lookup& found);

  const std::shared_ptr<const place::Vocabulary> vocabulary_;
  const std::shared_ptr<storage::Budget> budget_;
  place::PlaceIndex places_;
  place::PictureCache pictures_;  // of the thread that looks up
  CameraDoubts doubts_;
};

}  // namespace relmap::map
