// The identities of the sessions that `ingest --again` makes, new ones for each command. They are kept on disk until
// all sessions are in the map, so that the same command resumes where it was interrupted.
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
  // `folder`: where the record is kept; created if absent. `map`: the map that the recordings go into.
  AgainRecord(std::string folder, const std::string& map, const RecordingOptions& options,
              const std::vector<Sequence>& sequences);

  // Gives the sequences the identities that the same, interrupted command gave them before. A sequence keeps its
  // present identity if there is no former one, or if `outdated` says that the former session cannot take the recording
  // in any more. IO_ERROR.
  Status take_up(std::vector<Sequence>& sequences,
                 const std::function<bool(const SessionUuid&, const Sequence&)>& outdated) const;
  // Forgets one sequence: the same command makes a new session of it, and resumes the others. IO_ERROR.
  Status forget(const Sequence& sequence) const;
  // To be called when all are in the map: forgets all of them.
  void done() const;

 private:
  using Identities = std::map<std::string, SessionUuid>;  // by a key for each recording of the command
  Identities read() const;
  Status write(const Identities& identities) const;

  const std::string folder_, path_;
};

}  // namespace relmap::batch
