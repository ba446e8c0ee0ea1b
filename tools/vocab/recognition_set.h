// Recordings in which places are seen again, with the truth about which pictures show one place.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/ids.h"
#include "proto/status.h"

namespace relmap {

// Pictures in the order in which they are shown.
struct RecognitionSet {
  struct Picture {
    std::string file;
    FrameId frame;                    // consecutive in a session: neighbours
    bool asks = true;                 // what place is this?
    bool stays = true;                // and then becomes a place itself
    std::uint32_t open = 0;           // the pictures before this one are no recent past
    std::vector<std::uint32_t> same;  // of them, those that show the same place, ascending; none: a new place
  };
  std::vector<Picture> pictures;
};

// `name`: rtabmap (a corridor, and called so, too), euroc, tower, or drive, of relmap-sim; `folder` holds it.
// NO_SUCH_FILE, CORRUPT (a list that does not fit the pictures), INVALID_ARGUMENT (another name).
Result<RecognitionSet> load_recognition_set(const std::string& name, const std::string& folder);

}  // namespace relmap
