// Recognises places in keyframes: makes each frame a place, and looks it up among the places before it.
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
#include "server/place/picture_cache.h"
#include "server/place/place_index.h"
#include "server/place/vocabulary.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// How many threads or memories serve so many lookup threads with what is a few per cent of a lookup, so that they
// seldom wait for each other: queries of the index, and the preparation of keyframes.
constexpr std::size_t one_in_four(std::size_t lookup_threads) { return 1 + lookup_threads / 4; }

// One thread may call load(), add() and save() while any number look up.
class PlaceRecognition {
 public:
  // `folder`: the map's, in which the place index keeps its file. `threads` that look up at the same time.
  PlaceRecognition(std::shared_ptr<const place::Vocabulary> vocabulary, std::shared_ptr<storage::Budget> budget,
                   std::string folder, std::size_t threads);

  // Makes a place of every frame with words: from the index's folder, or else from the map. IO_ERROR, DATA_LOSS,
  // VIEW_EXPIRED: the words could not all be read, so some places would silently not be recognised.
  Status load(const storage::MapView& view);

  // Makes a frame with words a place. A frame is added when it comes into the map, before it is looked up, so that of
  // two robots that pass a place at the same time one finds the other.
  void add(FrameId frame, std::span<const std::uint32_t> words);

  // Looks the frame up among all places but later ones, and notes which calibrations it contradicts or confirms;
  // `newest` is that of map::look_up(). Returns the records of what was found. Throws StatusError.
  std::vector<storage::JournalRecord> look_up(const storage::MapView& view, FrameId frame,
                                              const LaterFrames& later = {}, const RouteMap& newest = {});

  // The session is being deleted: its frames are places no more.
  void forget(SessionNumber session);

  // Keeps the places in the folder, so that the next load() need not read the map.
  Status save() { return places_.save(); }

  const place::PlaceIndex& places() const { return places_; }
  std::vector<CameraDoubt> doubts() const { return doubts_.doubts(); }

 private:
  void count_doubts(SessionNumber session, const Lookup& found);

  const std::shared_ptr<const place::Vocabulary> vocabulary_;
  const std::shared_ptr<storage::Budget> budget_;
  place::PlaceIndex places_;
  place::PictureCache pictures_;
  CameraDoubts doubts_;
};

}  // namespace relmap::map
