// Sessions whose pictures contradict each other's calibration where they show the same places.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/ids.h"

namespace relmap::map {

struct CameraDoubt {
  SessionNumber session = 0;
  std::vector<SessionNumber> against;  // the sessions whose calibration its own contradicts, ascending
  std::uint64_t contradicted = 0;      // keyframes, its own and theirs
  std::string message;                 // of the last contradiction: what would fit
};

// Counts since the daemon started. Thread-safe.
class CameraDoubts {
 public:
  // Of two sessions; fewer may be chance.
  static constexpr std::uint64_t kMinKeyframes = 3;

  // A keyframe of the one session shows a place of the other, and fits another camera; both may be the same session.
  // The doubt that this has brought about, if any.
  std::optional<CameraDoubt> contradict(SessionNumber session, SessionNumber with, const std::string& message);
  // A keyframe of the one session recognised a place of another.
  void confirm(SessionNumber session, SessionNumber with);
  void forget(SessionNumber session);

  // Two sessions contradict each other where kMinKeyframes keyframes say so and no fewer than say the contrary. Which
  // of the two is wrong is told by the others: named are, one after the other until no contradiction is left, the
  // session with most contradictions less confirmations; of equal ones the newest. By session.
  std::vector<CameraDoubt> doubts() const;

 private:
  struct Pair {
    std::uint64_t contradicted = 0, confirmed = 0;
    std::string message;
  };
  using Sessions = std::pair<SessionNumber, SessionNumber>;  // ascending

  std::vector<CameraDoubt> doubts_locked() const;

  mutable std::mutex mutex_;
  std::map<Sessions, Pair> pairs_;
};

}  // namespace relmap::map
