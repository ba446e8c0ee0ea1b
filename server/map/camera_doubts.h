// Sessions whose pictures contradict their camera's calibration where they show places that the map knows.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "proto/ids.h"
#include "proto/status.h"

namespace relmap {

struct CameraDoubt {
  SessionNumber session = 0;
  std::uint64_t contradicted = 0;  // keyframes
  std::uint64_t confirmed = 0;     // keyframes for which closures were proposed, since the first contradiction
  std::string message;             // of the last contradiction: what would fit
};

// Counts since the daemon started. Thread-safe.
class CameraDoubts {
 public:
  // One alone may be chance.
  static constexpr std::uint64_t kFewest = 3;

  // True if the session has come to be in doubt by it. `contradiction`: WRONG_CALIBRATION.
  bool contradict(SessionNumber session, const Status& contradiction);
  void confirm(SessionNumber session);
  void forget(SessionNumber session);

  // kFewest contradictions and more, which are no fewer than the confirmations; by session.
  std::vector<CameraDoubt> doubts() const;

 private:
  mutable std::mutex mutex_;
  std::map<SessionNumber, CameraDoubt> sessions_;  // with a contradiction
};

}  // namespace relmap
