// Where the drawn pairs go: a folder of PNG pictures, or a film.
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
  // All of one size; `index`: of the pair in its source. IO_ERROR, UNSUPPORTED: no codec.
  virtual Status show(const ColourPicture& picture, std::uint64_t index) = 0;
  virtual Status close() = 0;  // IO_ERROR: not all of it is there
};

// A name that ends in .mp4, in any case, becomes a film of `rate_hz` pictures a second, which replaces what was there;
// any other a folder, made if absent, of a PNG for each pair, named by its index: 000017.png. `goes_on`: the run adds
// to an interrupted one. IO_ERROR; UNSUPPORTED: another kind of film; INVALID_ARGUMENT: pictures of another run are in
// the folder, or the film of the interrupted one would be lost.
Result<std::unique_ptr<TrackShow>> open_track_show(const std::string& path, double rate_hz, bool goes_on);

}  // namespace relmap::frontend
