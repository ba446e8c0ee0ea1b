// The sessions of `ingest --again`, which are new ones each time: kept until all of them are in the map, so that the
// same command goes on where it was interrupted.
#pragma once

#include <string>
#include <vector>

#include "proto/status.h"
#include "tools/batch/sequence.h"

namespace relmap::batch {

class AgainRecord {
 public:
  // `folder`: where such records are kept; made if absent. `map`: which map they go into.
  AgainRecord(std::string folder, const std::string& map, const RecordingOptions& options,
              const std::vector<Sequence>& sequences);

  // Gives the sequences the identities that the same command gave them before; where there was none, or it was done,
  // keeps those that they have. IO_ERROR.
  Status take_up(std::vector<Sequence>& sequences) const;
  // All are in the map: the next time they are new ones.
  void done() const;

 private:
  const std::string folder_, path_;
};

}  // namespace relmap::batch
