// The daemon's half of sealing (proto/access/datagram_seal.h): opens what robots have sealed, and seals what is for
// them. It takes the time as an argument, and uses no threads and no I/O. Not thread-safe.
//
// A message counts once and only for these seconds: it is sealed for this daemon's boot id, tells a time that the
// daemon has told within the last ten seconds, and has a count of its own. So nothing needs to be stored over restarts,
// and what is remembered of a robot's process can be forgotten after these ten seconds.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/access/access_list.h"
#include "proto/access/datagram_seal.h"
#include "proto/base/status.h"
#include "proto/keyframe/ingest_messages.h"
#include "server/ingest/replay_window.h"

namespace relmap::ingest {

class SealedRobots {
 public:
  using Time = std::chrono::steady_clock::time_point;

  static constexpr std::chrono::seconds kFresh{10};
  static constexpr std::size_t kMaxRuns = 64;      // processes of one robot at a time
  static constexpr std::size_t kMaxSessions = 64;  // of one robot, to which answers are sealed

  SealedRobots(const BootId& boot, const access::SealKey& secret, Time start)
      : boot_(boot), secret_(secret), start_(start) {}

  // Takes the keys of the list; only those that are there count from now on.
  void use(const access::AccessList& list);

  struct Opened {
    ByteSpan message;
    std::string robot;
    access::SealKeyId key;
    std::uint64_t run = 0;
  };
  // UNAUTHENTICATED: the message is not sealed, or not for this boot, or its key is unknown, expired or revoked.
  // REPLAYED: it came before, or is older than kFresh. RATE_LIMITED: more than kMaxRuns processes. `utc_s` is the time
  // by which keys expire.
  Result<Opened> open(std::string_view channel, ByteSpan datagram, Time now, std::int64_t utc_s);
  // The same for a hello, which is for any daemon and may come again.
  Result<Opened> open_hello(ByteSpan datagram, std::int64_t utc_s);
  // Whose messages were refused since the last call although they are sealed with a key that was issued, and why: "the
  // key of cart-1 was revoked". Of each key at most once every ten minutes; empty if there is nobody to name.
  std::string take_complaint() { return std::exchange(complaint_, {}); }

  // Notes that the robot's process sends the session.
  void sends(const Opened& from, const SessionUuid& session);
  // The message, sealed for each process of this robot that sends the session, and for no other robot: what is said to
  // one that has taken another's session would be believed by the other.
  std::vector<Bytes> seal(const SessionUuid& session, const std::string& robot, std::string_view channel,
                          const Bytes& message, Time now);
  // The answer to a hello; at most one every 5 ms to each of kMaxRuns processes of one robot, empty otherwise. Hellos
  // of former processes, which anyone may send again, leave the present one its answers.
  Bytes welcome(const Opened& from, const Bytes& message, Time now);

 private:
  struct Run {
    ReplayWindow counts;
    Time heard{};
  };
  struct Robot {
    Robot(access::Sealer s, std::string n) : sealer(std::move(s)), name(std::move(n)) {}
    access::Sealer sealer;
    std::string name;
    std::int64_t expires_s = 0;
    std::map<std::uint64_t, Run> runs;
    std::vector<SessionUuid> sessions;       // those of which recipients_ has an entry, the oldest first
    std::map<std::uint64_t, Time> welcomed;  // by process
  };
  // One that was revoked.
  struct Former {
    access::Sealer sealer;
    std::string name;
  };
  using Recipient = std::pair<SessionUuid, access::SealKeyId>;

  Result<Robot*> verified(std::string_view channel, const access::SealBoot& boot, const access::SealedMessage& sealed,
                          std::int64_t utc_s);
  Status complain(const access::SealKeyId& key, const std::string& why, std::int64_t utc_s);
  std::uint64_t time_us(Time now) const;
  void seal(Robot& robot, const access::SealKeyId& key, std::uint64_t run, std::string_view channel, Time now,
            Bytes& message);

  const BootId boot_;
  const access::SealKey secret_;
  const Time start_;
  std::uint64_t sent_ = 0;
  std::map<access::SealKeyId, Robot> robots_;
  std::map<access::SealKeyId, Former> former_;
  std::map<access::SealKeyId, std::int64_t> complained_;  // when, UTC seconds
  std::string complaint_;
  std::map<Recipient, std::uint64_t> recipients_;  // the run for which to seal
};

}  // namespace relmap::ingest
