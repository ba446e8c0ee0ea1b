// What tells a recording from others, and from itself before it was changed, as relmap-frontend says it.
#pragma once

#include <cstdint>
#include <string>

namespace relmap::batch {

// Of pairs, pictures of one camera, or ready-made keyframes. The same for a copy elsewhere.
struct RecordingIdentity {
  std::string fingerprint;  // of its beginning
  std::uint64_t count = 0;
  std::string contents;     // a checksum of names, sizes and times of all
  std::string calibration;  // empty: keyframes, which hold their camera

  bool operator==(const RecordingIdentity&) const = default;
};

// "is made of 1,200 pairs, and there are 1,500 now": of the session that was made of `then`. Empty: they are the same.
// `photographs`: pictures by themselves, of which none is the beginning.
std::string change_text(const RecordingIdentity& then, const RecordingIdentity& now, bool photographs);

}  // namespace relmap::batch
