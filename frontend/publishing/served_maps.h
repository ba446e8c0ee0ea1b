// Which daemon serves which map, and which of them a session may be published to. A state machine: time is an argument,
// no threads, no I/O.
#pragma once

#include <chrono>
#include <map>
#include <optional>

#include "proto/base/map_identity.h"
#include "proto/base/status.h"
#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

struct ServedMapsOptions {
  // The source can be published again from its beginning: then a map that was restored from a backup since it was sent
  // is another one.
  bool repeated = false;
  // There is one daemon at a time, and the next one introduces itself. Else several may be heard, whoever is silent for
  // a while has gone, and one that never introduces itself is an old one, of whose map nothing is known.
  bool lossless = false;
};

// A session is in the map of the first daemon that acknowledged some of it. Not thread-safe.
class ServedMaps {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit ServedMaps(ServedMapsOptions options) : options_(options) {}

  // The map that a spool says the session is in; before anything else.
  void load(const MapIdentity& map) { map_ = map; }

  // A daemon says which map it serves. `acknowledging`: that with which the session is exchanged, if there is one.
  void introduce(const DaemonIdentity& daemon, const std::optional<BootId>& acknowledging, Time now);
  // Whether what the daemon acknowledges is to be believed: it serves the session's map. Where the session is in one, a
  // boot that was not introduced is believed only after a while: its daemon is an old one, that has nothing to say.
  bool believes(const BootId& boot, Time now);
  // Whether its map is the session's, restored from a backup since.
  bool restored(const BootId& boot) const;
  // It has acknowledged some of the session, and is believed: the session is in its map.
  void acknowledged_by(const BootId& boot);
  // Somebody waits to send, from the first time on that this is called.
  void wait_since(Time now);
  void broken();

  // The map that the session is in; not known: in none yet.
  const MapIdentity& map() const { return map_; }
  // A daemon has said which map it serves, and it is the session's, or the session is in none yet.
  bool introduced() const { return introduced_ && !other_; }
  // WRONG_MAP: the daemon serves another map. MAP_RESTORED: this one, restored from a backup, and the source can be
  // read again. Where several may be heard, only when no other has spoken for a while.
  Status status(const SessionUuid& session, Time now) const;
  // Whether anything may be sent to whoever listens now. Whoever gets the first keyframe takes the session in.
  bool may_send(Time now) const;
  // Whether a boot is one of a daemon that is not believed.
  bool is_other(const BootId& boot) const;

 private:
  MapIdentity of(const BootId& boot) const;  // not known: it was not introduced, or serves no map yet
  bool belongs_to(const MapIdentity& map) const;
  void hear_other(const MapIdentity& map, Time now);
  bool other_speaks(Time now) const;

  const ServedMapsOptions options_;
  MapIdentity map_;
  std::map<BootId, MapIdentity> daemons_;  // as they were introduced
  std::map<BootId, Time> unnamed_;         // those that were not, since when they are heard
  bool introduced_ = false;
  std::optional<Time> waiting_since_;
  std::optional<MapIdentity> other_;    // that of the daemon that spoke last, where the session is not in it
  Time other_since_{}, other_heard_{};  // first, and last
};

}  // namespace relmap::publishing
