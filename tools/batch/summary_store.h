// Files beside the map with what is known of each session: the identity of its recording, and the front-end's summary.
// By these a later run recognises that a recording has changed since, and reports sessions that were there already.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "tools/batch/front_end.h"

namespace relmap::batch {

class SummaryStore {
 public:
  // `folder` is created when something is written; empty: nothing is kept. `map`: uuid of the map that the sessions are
  // in; empty: not known.
  SummaryStore(std::string folder, std::string map) : folder_(std::move(folder)), map_(std::move(map)) {}

  // What is kept of a session. `json` is empty if the session did not end; `recording` is nullopt if an older version
  // made the session; both if nothing is kept.
  Summary read(const SessionUuid& uuid) const;
  // Keeps what the session is going to be made of. To be called before anything is sent. IO_ERROR.
  Status begin(const SessionUuid& uuid, const RecordingIdentity& recording) const;
  // Keeps the summary in place of what begin() kept. IO_ERROR.
  Status done(const SessionUuid& uuid, const Summary& summary) const;
  // Keeps that --again made the session `other` of the recording whose own session is `own`. IO_ERROR.
  Status taken_in_as(const SessionUuid& own, const SessionUuid& other) const;
  // The newest session that --again made of the recording.
  std::optional<SessionUuid> other_of(const SessionUuid& own) const;
  // Why the map doubted the calibration of the session's camera. Only the daemon with this boot id knows of the doubt.
  struct Doubt {
    std::string boot, text;
    bool operator==(const Doubt&) const = default;
  };
  Status doubt(const SessionUuid& uuid, const Doubt& doubt) const;  // IO_ERROR
  std::optional<Doubt> doubt_of(const SessionUuid& uuid) const;
  void forget_doubt(const SessionUuid& uuid) const;

 private:
  std::string folder_of_map() const { return map_.empty() ? folder_ : folder_ + '/' + map_; }
  std::string path_of(const SessionUuid& uuid, const char* ending) const {
    return folder_of_map() + '/' + uuid.to_string() + ending;
  }
  Status write(const std::string& path, const std::string& text) const;

  const std::string folder_, map_;
};

}  // namespace relmap::batch
