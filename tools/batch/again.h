// The sessions of `ingest --again`, which are new ones each time: kept until all of them are in the map, so that the
// same command goes on where it was interrupted.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "tools/batch/sequence.h"

namespace relmap::batch {

class AgainRecord {
 public:
  // `folder`: where such records are kept; made if absent. `map`: which map they go into.
  AgainRecord(std::string folder, const std::string& map, const RecordingOptions& options,
              const std::vector<Sequence>& sequences);

  // Gives the sequences the identities that the same command gave them before; where there was none, it was done, or
  // `outdated` says that the session of that identity does not take this recording in, keeps those that they have.
  // IO_ERROR.
  Status take_up(std::vector<Sequence>& sequences,
                 const std::function<bool(const SessionUuid&, const Sequence&)>& outdated) const;
  // The next time this one is a new session, though others of the command are not done. IO_ERROR.
  Status forget(const Sequence& sequence) const;
  // All are in the map: the next time they are new ones.
  void done() const;

 private:
  using Identities = std::map<std::string, SessionUuid>;  // by what tells the recordings of a command apart
  Identities read() const;
  Status write(const Identities& identities) const;

  const std::string folder_, path_;
};

}  // namespace relmap::batch
