// Where the drawn pairs go: a folder of PNG pictures, or a film.
#pragma once

#include <memory>
#include <string>

#include "frontend/track_picture.h"
#include "proto/status.h"

namespace relmap {

// Not thread-safe.
class TrackShow {
 public:
  virtual ~TrackShow() = default;
  virtual Status show(const ColourPicture& picture) = 0;  // all of one size; IO_ERROR, UNSUPPORTED
  virtual Status close() = 0;                             // IO_ERROR: not all of it is there
};

// A name that ends in .mp4 becomes a film of `rate_hz` pictures a second, any other a folder, made if absent, of
// 000000.png and so on. IO_ERROR. A codec that is missing shows with the first picture: UNSUPPORTED.
Result<std::unique_ptr<TrackShow>> open_track_show(const std::string& path, double rate_hz);

}  // namespace relmap
