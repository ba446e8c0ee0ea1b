// Some frames of a map that stand for all of them, where reading all would take too long.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/map_types.h"

namespace relmap::cli {

// The frames of a session, ascending; each is there once.
struct SampledSession {
  SessionNumber session = 0;
  std::vector<std::uint32_t> indices;
};

// Chooses about `most` frames: of each session a share by its size, but at least three, or all that it has, so that a
// small one is not passed over. Of more than `most` sessions with frames only `most` are chosen. Both are spread
// evenly, from the first to the last.
std::vector<SampledSession> sample_frames(const std::vector<client::Session>& sessions, std::size_t most);

}  // namespace relmap::cli
