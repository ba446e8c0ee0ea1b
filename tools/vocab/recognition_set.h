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
    bool asks = true;                     // what place is this?
    bool stays = true;                    // and then becomes a place itself
    std::uint32_t open = 0;               // the pictures before this one are no recent past
    std::vector<std::uint32_t> same;      // of them, those that show the same place, ascending; none: a new place
    std::optional<std::uint32_t> itself;  // of them, this very picture: no answer
  };
  std::vector<Picture> pictures;
};

// `folders`: of the set, and then of what the map holds beside.
//   rtabmap, or corridor   two laps of one
//   euroc                  a flight through one room
//   drive                  of relmap-sim
//   tower, tower-area      floors that look alike, some of them in each folder: which floor is it? Which area of it?
//   walk                   photographs along a street: each asks for those next to it, up to two away
//   front                  photographs of one thing: each asks for the others
// The last two among pictures of anything else, a folder of them a session. NO_SUCH_FILE, CORRUPT (a list that does not
// fit the pictures), INVALID_ARGUMENT (another name, or folders of which the set makes no use).
Result<RecognitionSet> load_recognition_set(const std::string& name, const std::vector<std::string>& folders);

}  // namespace relmap::vocab
