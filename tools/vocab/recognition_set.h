// Recordings in which places are seen again, with the truth about which pictures show one place.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"

namespace relmap::vocab {

// Pictures in the order in which they are shown.
struct RecognitionSet {
  struct Picture {
    std::string file;
    FrameId frame;                        // consecutive in a session: neighbours
    bool asks = true;                     // whether it asks for its place
    bool stays = true;                    // whether it becomes a place of the map afterwards
    std::uint32_t open = 0;               // only pictures before this index are old enough to be answers
    std::vector<std::uint32_t> same;      // those of them that show the same place, ascending; empty: a new place
    std::optional<std::uint32_t> itself;  // the one of them that is this very picture, which is no answer
  };
  std::vector<Picture> pictures;
};

// Loads the set `name` from the first of `folders`; the others hold further places of the map.
//   rtabmap, or corridor   two laps of one corridor
//   euroc                  a flight through one room
//   drive                  of relmap-sim
//   tower, tower-area      floors that look alike, some in each folder: a query asks for the floor, or its area
//   walk                   photographs along a street: each asks for those next to it, up to two away
//   front                  photographs of one building: each asks for the others
// For walk and front, each further folder holds pictures of other places and is one session. NO_SUCH_FILE; CORRUPT (a
// list that does not fit the pictures); INVALID_ARGUMENT (another name, or folders that the set does not use).
Result<RecognitionSet> load_recognition_set(const std::string& name, const std::vector<std::string>& folders);

}  // namespace relmap::vocab
