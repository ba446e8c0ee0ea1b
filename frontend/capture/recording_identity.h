// What tells a recording from others, and from itself before it was changed.
#pragma once

#include <cstdint>
#include <string>

#include "frontend/capture/stereo_source.h"
#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::capture {

// The same for a copy elsewhere: neither where the files lie nor when they were written is in it. No picture is read
// but the first.
struct RecordingIdentity {
  std::string fingerprint;     // StereoSource::fingerprint(): of its beginning, so that it outlasts what is added later
  std::uint64_t count = 0;     // pairs, of one eye pictures, or keyframes
  std::uint32_t contents = 0;  // StereoSource::contents(), and what an inertial unit said meanwhile
  std::string calibration;     // a line that no other calibration has; empty: keyframes, which hold their camera

  bool operator==(const RecordingIdentity&) const = default;
};

RecordingIdentity identity_of(const StereoSource& source);

// Of a file of keyframes: what is whole of it. Reads the first of them, and of the others their beginnings.
struct KeyframeFileIdentity {
  RecordingIdentity recording;
  SessionHeader session;  // of the first keyframe
};
// NO_SUCH_FILE; BAD_SIZE: no keyframe in it; those of KeyframeFileReader::next() for the first.
Result<KeyframeFileIdentity> identity_of_keyframes(const std::string& path);

// The fingerprint of the keyframes of a session, whatever holds them.
std::string fingerprint_of_keyframes(const SessionHeader& session);

}  // namespace relmap::capture
