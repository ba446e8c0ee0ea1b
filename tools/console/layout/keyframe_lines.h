// Every keyframe of some sessions, bent onto the points of a layout: for a closer look than the layout itself has.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "client/relmap_client.h"
#include "proto/base/mutex.h"
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

// A client, or why there is none now.
using ClientOf = std::function<Result<std::shared_ptr<client::Client>>()>;

// Keeps the lines that were used last. Thread-safe.
class KeyframeLines {
 public:
  // `away`: for so long a daemon that did not answer is not asked again.
  KeyframeLines(std::size_t max_bytes, std::chrono::milliseconds away) : away_(away), kept_(max_bytes) {}

  using Lines = std::map<SessionNumber, std::shared_ptr<const KeyframeLine>>;
  // Those that are kept.
  Lines kept(const MapLayout& layout, const std::vector<SessionNumber>& sessions);
  // Reads what it does not have through the client, for ten seconds at most. One thread at a time does: the others wait
  // for it, since most of them want the same lines, and share its failure. The reasons of Client::skeleton().
  Result<Lines> of(const MapLayout& layout, const std::vector<SessionNumber>& sessions, const ClientOf& client);

 private:
  using Clock = std::chrono::steady_clock;
  using Key = std::pair<std::uint64_t, SessionNumber>;  // version of the layout
  Status read(const MapLayout& layout, const std::vector<SessionNumber>& missing, client::Client& client, Lines& lines);

  const std::chrono::milliseconds away_;
  LruCache<Key, KeyframeLine> kept_;
  Mutex reading_;                               // held by the thread that asks the daemon
  Status failure_ RELMAP_GUARDED_BY(reading_);  // to reach it, not ok until `asked_again_`
  Clock::time_point asked_again_ RELMAP_GUARDED_BY(reading_){};
};

}  // namespace relmap::console
