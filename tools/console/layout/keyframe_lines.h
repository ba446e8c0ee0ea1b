// Every keyframe of some sessions, bent onto the points of a layout: for a closer look than the layout itself has.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "client/relmap_client.h"
#include "tools/console/layout/lru_cache.h"
#include "tools/console/layout/map_layout.h"

namespace relmap::console {

// Keyframes between points of a layout.
struct KeyframeLine {
  struct Keyframe {
    Vector2 at = Vector2::Zero();  // in the world
    std::uint32_t index = 0, time_s = 0;
    std::uint8_t flags = 0;  // PointFlag, of the step to it
  };
  std::vector<Keyframe> keyframes;  // ascending; of those that are points of the layout there are none

  std::size_t bytes() const { return sizeof *this + keyframes.capacity() * sizeof(Keyframe); }
};

// Composes the steps of a chain from each point of the layout to the next, and distributes over them, in equal shares,
// by what they miss the next. `skeleton`: of level 3, of one session. Frames that the layout does not go over are left
// out.
KeyframeLine bend_onto(const MapLayout& layout, SessionNumber session, const client::Skeleton& skeleton);

// Keeps the lines that were used last. Thread-safe.
class KeyframeLines {
 public:
  explicit KeyframeLines(std::size_t max_bytes) : kept_(max_bytes) {}

  // Reads what it does not have through the client. The reasons of Client::skeleton().
  using Lines = std::map<SessionNumber, std::shared_ptr<const KeyframeLine>>;
  Result<Lines> of(const MapLayout& layout, const std::vector<SessionNumber>& sessions, client::Client& client);

 private:
  using Key = std::pair<std::uint64_t, SessionNumber>;  // version of the layout
  LruCache<Key, KeyframeLine> kept_;
};

}  // namespace relmap::console
