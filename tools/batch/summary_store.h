// What is kept of sessions beside the map: what their recordings were, and the front-ends' summaries. A later run tells
// by them whether a recording is still the one that a session is made of, and reports what was there already.
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
  // `folder`: made when something is written; empty: nothing is kept. `map`: which map the sessions are in; empty: not
  // known.
  SummaryStore(std::string folder, std::string map) : folder_(std::move(folder)), map_(std::move(map)) {}

  // Without json: the session did not end, or nothing was kept; without recording: nothing was, or by an older version.
  Summary read(const SessionUuid& uuid) const;
  // What the session is going to be made of, before anything of it is sent. IO_ERROR.
  Status begin(const SessionUuid& uuid, const RecordingIdentity& recording) const;
  // Takes the place of that. IO_ERROR.
  Status done(const SessionUuid& uuid, const Summary& summary) const;
  // The recording whose own session would be `own` became session `other` by --again. IO_ERROR.
  Status taken_in_as(const SessionUuid& own, const SessionUuid& other) const;
  // The newest of these.
  std::optional<SessionUuid> other_of(const SessionUuid& own) const;
  // What the map held against the calibration of the session's camera, and which daemon (its boot) said so: no other
  // one knows of it. IO_ERROR.
  struct Doubt {
    std::string boot, text;
    bool operator==(const Doubt&) const = default;
  };
  Status doubt(const SessionUuid& uuid, const Doubt& doubt) const;
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
