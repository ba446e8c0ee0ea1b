// Writes the drawn pairs to a folder of PNG pictures, or to a film.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "frontend/track_picture.h"
#include "proto/base/status.h"

namespace relmap::frontend {

// Not thread-safe.
class TrackShow {
 public:
  virtual ~TrackShow() = default;
  // All pictures must have the same size; `index` is that of the pair in its source. IO_ERROR; UNSUPPORTED if there is
  // no codec.
  virtual Status show(const ColourPicture& picture, std::uint64_t index) = 0;
  virtual Status close() = 0;  // IO_ERROR if not everything was written
};

// A path that ends in .mp4 (upper or lower case) becomes a film of `rate_hz` pictures a second, which replaces an
// existing one. Any other path is a folder, created if missing, with a PNG for each pair, named by its index
// (000017.png). `goes_on` says that the run continues an interrupted one. IO_ERROR; UNSUPPORTED for another format of
// film; INVALID_ARGUMENT if the folder has pictures of another run, or the film of the interrupted run would be lost.
Result<std::unique_ptr<TrackShow>> open_track_show(const std::string& path, double rate_hz, bool goes_on);

}  // namespace relmap::frontend
