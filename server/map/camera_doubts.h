// Finds sessions with a wrong calibration: their pictures contradict those of other sessions that show the same places.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/mutex.h"

namespace relmap::map {

struct CameraDoubt {
  SessionNumber session = 0;
  std::vector<SessionNumber> against;  // sessions whose calibration contradicts that of `session`, ascending
  std::uint64_t contradicted = 0;      // number of keyframes, of all these sessions, that show a contradiction
  std::string message;                 // of the last contradiction: which calibration would fit
};

// Counts start anew with the daemon. Thread-safe.
class CameraDoubts {
 public:
  // Contradicting keyframes needed for two sessions to contradict each other; fewer may be chance.
  static constexpr std::uint64_t kMinKeyframes = 3;

  // Notes that a keyframe of `session` shows a place of session `with` but fits another calibration. Both may be the
  // same session. Returns the doubt that this has raised, if any.
  std::optional<CameraDoubt> contradict(SessionNumber session, SessionNumber with, const std::string& message);
  // Notes that a keyframe of `session` recognised a place of session `with`.
  void confirm(SessionNumber session, SessionNumber with);
  void forget(SessionNumber session);

  // The doubtful sessions, ascending by number. Two sessions contradict each other if at least kMinKeyframes keyframes
  // say so, and at least as many as confirm the pair. The other sessions tell which of the two is wrong: the session
  // with the most contradicted less confirmed sessions (the newest of several) is doubtful; its contradictions are then
  // set aside, and the next is chosen, until no contradiction is left.
  std::vector<CameraDoubt> doubts() const;

 private:
  struct Pair {
    std::uint64_t contradicted = 0, confirmed = 0;
    std::string message;
  };
  using Sessions = std::pair<SessionNumber, SessionNumber>;  // ascending

  std::vector<CameraDoubt> doubts_locked() const RELMAP_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<Sessions, Pair> pairs_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::map
