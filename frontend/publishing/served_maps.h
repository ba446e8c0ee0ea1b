// Knows which daemon serves which map, and to which of them a session may be published. It is a state machine that
// takes the time as an argument and uses no threads and no I/O.
#pragma once

#include <chrono>
#include <map>
#include <optional>

#include "proto/base/map_identity.h"
#include "proto/base/status.h"
#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

struct ServedMapsOptions {
  // The source can be published again from its beginning. A map that was restored from a backup since the source was
  // sent then counts as another map.
  bool repeated = false;
  // There is one daemon at a time, and the next one introduces itself. Otherwise several daemons may be heard, a daemon
  // that is silent for a while has gone, and one that never introduces itself is an old one, whose map is not known.
  bool lossless = false;
  Uuid only = {};  // the session may be published into this map only; nil: into any
};

// A session belongs to the map of the first daemon that acknowledged a keyframe of it. Not thread-safe.
class ServedMaps {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit ServedMaps(ServedMapsOptions options) : options_(options) {}

  // The session's map as stored in the spool; call it before all other functions.
  void load(const MapIdentity& map) { map_ = map; }

  // A daemon says which map it serves. `acknowledging` is the daemon that acknowledges the session's keyframes, if any.
  void introduce(const DaemonIdentity& daemon, const std::optional<BootId>& acknowledging, Time now);
  // Whether acknowledgements of the daemon count, that is, whether it serves the session's map. If the session is in a
  // map, a daemon that was not introduced is believed only after a while: it must be an old one that never will be.
  bool believes(const BootId& boot, Time now);
  // Whether the daemon serves the session's map as restored from a backup since.
  bool restored(const BootId& boot) const;
  // A daemon that is believed has acknowledged keyframes: the session is in its map.
  void acknowledged_by(const BootId& boot);
  // The session waits to send; the first call counts.
  void wait_since(Time now);
  void broken();

  // The session's map; not known if it is in none yet.
  const MapIdentity& map() const { return map_; }
  // A daemon has said that it serves the session's map, or any map if the session is in none yet.
  bool introduced() const { return introduced_ && !other_; }
  // WRONG_MAP if the daemon serves another map. MAP_RESTORED if it serves the session's map, restored from a backup,
  // and the source is repeatable. If several daemons may be heard, only once no other one has spoken for a while.
  Status status(const SessionUuid& session, Time now) const;
  // Whether keyframes may be sent to the daemon that listens now. The one that gets the first keyframe takes the
  // session.
  bool may_send(Time now) const;
  // Whether the daemon of this boot serves another map.
  bool is_other(const BootId& boot) const;

 private:
  MapIdentity of(const BootId& boot) const;  // not known if it was not introduced, or serves no map yet
  bool belongs_to(const MapIdentity& map) const;
  void hear_other(const MapIdentity& map, Time now);
  bool other_speaks(Time now) const;

  const ServedMapsOptions options_;
  MapIdentity map_;
  std::map<BootId, MapIdentity> daemons_;  // of daemons that were introduced
  std::map<BootId, Time> unnamed_;         // when daemons that were not introduced were first heard
  bool introduced_ = false;
  std::optional<Time> waiting_since_;
  std::optional<MapIdentity> other_;    // map of the daemon that spoke last, if it is not the session's
  Time other_since_{}, other_heard_{};  // when such a daemon was heard first and last
};

}  // namespace relmap::publishing
