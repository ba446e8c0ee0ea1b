// What distinguishes a recording from others, and from its own earlier state, as relmap-frontend reports it.
#pragma once

#include <cstdint>
#include <string>

namespace relmap::batch {

// Identity of a recording of pairs, pictures of one camera, or ready-made keyframes. A copy has the same identity.
struct RecordingIdentity {
  std::string fingerprint;  // of the first items
  std::uint64_t count = 0;  // of pairs, pictures or keyframes
  std::string contents;     // checksum of the names, sizes and times of all items
  std::string calibration;  // empty for keyframes, which contain their camera

  bool operator==(const RecordingIdentity&) const = default;
};

// How the recording has changed since a session was made of `then`: "is made of 1,200 pairs, and there are 1,500 now".
// Empty if it has not changed. `photographs`: single pictures, which have no order.
std::string change_text(const RecordingIdentity& then, const RecordingIdentity& now, bool photographs);

}  // namespace relmap::batch
