// Identifies a recording, and detects that it was changed.
#pragma once

#include <cstdint>
#include <string>

#include "frontend/capture/stereo_source.h"
#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::capture {

// It is the same for a copy elsewhere, since it contains neither paths nor times of files. Only the first picture is
// read.
struct RecordingIdentity {
  std::string fingerprint;     // StereoSource::fingerprint(), of the beginning; appending to the recording keeps it
  std::uint64_t count = 0;     // number of pairs, of pictures (one eye), or of keyframes
  std::uint32_t contents = 0;  // StereoSource::contents() and the recording of the inertial unit
  std::string calibration;  // one line that differs between calibrations; empty for keyframes, which have their camera

  bool operator==(const RecordingIdentity&) const = default;
};

RecordingIdentity identity_of(const StereoSource& source);

// The identity of a file of keyframes, up to where it is intact. Reads the first keyframe, and the beginnings of the
// others.
struct KeyframeFileIdentity {
  RecordingIdentity recording;
  SessionHeader session;  // of the first keyframe
};
// NO_SUCH_FILE; BAD_SIZE if the file has no keyframe; the reasons of KeyframeFileReader::next() for the first one.
Result<KeyframeFileIdentity> identity_of_keyframes(const std::string& path);

// The fingerprint of a session's keyframes, independent of where they are stored.
std::string fingerprint_of_keyframes(const SessionHeader& session);

}  // namespace relmap::capture
