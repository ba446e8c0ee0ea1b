// A robot's half of sealing (proto/access/datagram_seal.h): knows which daemon its messages are for, and which messages
// are that daemon's and new. It takes the time as an argument, and uses no threads and no I/O. Not thread-safe.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string_view>

#include "proto/access/datagram_seal.h"
#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

class SealedDaemon {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // `run` is random, and new in each process.
  SealedDaemon(const access::RobotKey& key, std::uint64_t run);

  // Only daemons of this map are addressed from now on. Until it is called, the first one that says welcome is, and
  // then those of its map.
  void pin(const Uuid& map);

  // Seals a question that any daemon may answer, with a welcome.
  void seal_hello(Bytes& hello);
  // Whether hello should be said: no daemon is addressed, or it has been silent for a second.
  bool wants_hello(Time now) const;
  // Whether the addressed daemon was heard so recently that it will take what is sealed for it now.
  bool ready(Time now) const;
  // Seals a message for the addressed daemon. Requires ready().
  void seal(std::string_view channel, Bytes& message);

  // What a daemon has sealed for this run; nullopt for anything else. The message says of which daemon it is, and
  // counts only if heard() then says so.
  std::optional<access::SealedMessage> open(std::string_view channel, ByteSpan datagram);
  // Whether a message that open() has opened is newer than all before from the daemon of this boot.
  bool heard(const BootId& boot, const access::Seal& seal, Time now);
  // A message that counts was a welcome. Returns whether the daemon is the addressed one now. Another one takes its
  // place only once it is silent, so that two daemons of one map do not take turns.
  bool welcome(const DaemonIdentity& daemon, Time now);

 private:
  struct Daemon {
    std::uint64_t count = 0, time_us = 0;  // of its newest message
    Time heard{};
  };
  const Daemon* addressed() const;

  const access::RobotKey key_;
  const std::uint64_t run_;
  access::Sealer sealer_;
  std::uint64_t sent_ = 0;
  std::optional<Uuid> map_;
  std::optional<BootId> addressed_;
  std::map<BootId, Daemon> daemons_;
};

}  // namespace relmap::publishing
