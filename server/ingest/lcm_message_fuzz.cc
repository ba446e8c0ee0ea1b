// Any bytes as each message that comes over LCM and as the secret of a fleet: as they are, as a datagram on each side,
// and in the exchange of a robot and a daemon that seal what they send. The first byte chooses the message, the second
// one how far the exchange goes (Flag), the third one the seconds until the daemon takes what the robot has sealed, and
// the fourth one the time that it is then, by which keys expire.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <utility>

#include "frontend/publishing/lcm/sealed_daemon.h"
#include "proto/base/hex.h"
#include "proto/base/testing/fuzzing.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"
#include "server/ingest/sealed_robots.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using fuzzing::must;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Time = ingest::SealedRobots::Time;

enum Flag : std::uint8_t {
  kPinned = 1,        // the robot wants another map
  kManyDaemons = 2,   // more than a robot remembers have spoken to it
  kManyRuns = 4,      // more processes of the robot than a daemon remembers
  kManySessions = 8,  // more sessions of the robot than a daemon remembers
  kRevoked = 16,      // the robot's key is revoked in the meantime
};

constexpr access::SealKey kSecret{1}, kDrawn{2}, kOther{3};
constexpr BootId kBoot{3};
constexpr std::uint64_t kRun = 7;
constexpr std::int64_t kExpires_s = 128, kMeetsBefore_s = 64;
constexpr std::size_t kBeginning = 4;  // bytes before the message
constexpr SessionUuid kSession{{5}};
const Time kStart{};
const Time kNow = kStart + seconds(100);

// What is decoded is encoded and decoded again alike.
template <typename Message>
void decode(Result<Message> (*decoder)(ByteSpan), ByteSpan bytes) {
  const auto message = decoder(bytes);
  if (!message.ok()) return;
  const Bytes encoded = encode_lcm(*message);
  const auto again = decoder(encoded);
  must(again.ok() && encode_lcm(*again) == encoded);
}

void decode_as(unsigned kind, ByteSpan bytes) {
  switch (kind % 7) {
    case 0:
      return decode(decode_lcm_part, bytes);
    case 1:
      return decode(decode_lcm_gap, bytes);
    case 2:
      return decode(decode_lcm_end, bytes);
    case 3:
      return decode(decode_lcm_acknowledgement, bytes);
    case 4:
      return decode(decode_lcm_pose, bytes);
    case 5:
      return decode(decode_lcm_map, bytes);
    default:
      return decode(decode_lcm_hello, bytes);
  }
}

access::AccessList access_list(bool revoked) {
  using access::Grant;
  access::AccessList list;
  list.add({Grant::Kind::kKey, hex(kDrawn), {access::Role::kRobot, "cart"}, kExpires_s, revoked});
  list.add({Grant::Kind::kToken, hex(kOther), {access::Role::kRobot, "cart"}, kExpires_s, false});
  list.add({Grant::Kind::kKey, hex(kOther), {access::Role::kReader, "dash"}, kExpires_s, false});
  return list;
}

struct Exchange {
  static const access::RobotKey& key() {
    static const access::RobotKey kKey = access::robot_key(kSecret, kDrawn);
    return kKey;
  }

  // Nobody finds a seal by chance.
  void take_unsealed(const Bytes& datagram) {
    must(robots.open(kGapChannel, datagram, kNow, 0).reason() == Reason::UNAUTHENTICATED);
    must(robots.open_hello(datagram, 0).reason() == Reason::UNAUTHENTICATED);
    must(!daemon.open(kAckChannel, datagram));
  }

  // The robot asks who listens, and the daemon answers. Returns whether the robot addresses the daemon now.
  bool meet(const Bytes& message, unsigned flags, std::int64_t utc_s) {
    must(daemon.wants_hello(kNow) && !daemon.ready(kNow));
    if ((flags & kPinned) != 0) daemon.pin(Uuid{{9}});
    Bytes hello = message;
    daemon.seal_hello(hello);
    must(!robots.open(kHelloChannel, hello, kNow, utc_s).ok());  // it is for no daemon of its own
    const auto asked = robots.open_hello(hello, utc_s);
    must(asked.ok() == (utc_s < kExpires_s));
    if (!asked.ok()) return false;
    must(asked->robot == "cart" && std::ranges::equal(asked->message, message));
    must(robots.open_hello(hello, utc_s).ok());
    robots.sends(*asked, kSession);
    if ((flags & kManySessions) != 0) send_many_sessions(*asked);

    const Bytes identity = encode_lcm(DaemonIdentity{kBoot, {Uuid{{8}}, 1}});
    const Bytes welcome = robots.welcome(*asked, identity, kNow);
    must(!welcome.empty() && robots.welcome(*asked, identity, kNow + milliseconds(1)).empty());
    must(!daemon.open(kAckChannel, welcome));
    const auto heard = daemon.open(kMapChannel, welcome);
    must(heard && std::ranges::equal(heard->message, identity));
    const auto told = decode_lcm_map(heard->message).or_throw();
    must(daemon.heard(told.boot, heard->seal, kNow) && !daemon.heard(told.boot, heard->seal, kNow));
    must(daemon.welcome(told, kNow) == ((flags & kPinned) == 0) && daemon.ready(kNow) == ((flags & kPinned) == 0));
    if (!daemon.ready(kNow)) return false;
    // Another daemon of the map has to wait until this one is silent.
    must(!daemon.welcome({BootId{4}, told.map}, kNow) && daemon.wants_hello(kNow + seconds(1)));
    if ((flags & kManyDaemons) != 0)
      for (std::uint8_t i = 0; i < 100; ++i) daemon.heard(BootId{200, i}, {key().id, kRun, 1, 1}, kNow + seconds(i));
    must(!daemon.ready(kNow + seconds(4)));
    return true;
  }

  void send(const Bytes& message, unsigned flags, seconds later, std::int64_t utc_s) {
    Bytes sealed = message;
    daemon.seal(kGapChannel, sealed);
    if ((flags & kManyRuns) != 0) send_from_many_runs(message);
    if ((flags & kRevoked) != 0) robots.use(access_list(true));
    must(!robots.open(kEndChannel, sealed, kNow, utc_s).ok());
    Bytes changed = sealed;
    changed[changed.size() / 2] ^= 1;
    must(!robots.open(kGapChannel, changed, kNow, utc_s).ok());
    const auto opened = robots.open(kGapChannel, sealed, kNow + later, utc_s);
    const bool known = (flags & kRevoked) == 0 && utc_s < kExpires_s;
    const bool fresh = later >= seconds(0) && later <= ingest::SealedRobots::kFresh;
    if (!known)
      must(opened.reason() == Reason::UNAUTHENTICATED);
    else if (!fresh)
      must(opened.reason() == Reason::REPLAYED);
    else if ((flags & kManyRuns) != 0)
      must(opened.reason() == Reason::RATE_LIMITED);
    else
      must(opened.ok() && std::ranges::equal(opened->message, message) &&
           robots.open(kGapChannel, sealed, kNow + later, utc_s).reason() == Reason::REPLAYED);
  }

  // What the daemon tells the robot of its session.
  void answer(unsigned kind, const Bytes& message, unsigned flags) {
    const auto answers = robots.seal(kSession, "cart", kAckChannel, message, kNow);
    must(answers.size() == ((flags & (kRevoked | kManySessions)) == 0 ? 1u : 0u));
    for (const Bytes& sealed : answers) {
      const auto heard = daemon.open(kAckChannel, sealed);
      must(heard && std::ranges::equal(heard->message, message) && daemon.heard(kBoot, heard->seal, kNow));
      decode_as(kind, heard->message);
    }
    must(robots.seal(kSession, "dash", kAckChannel, message, kNow).empty());
    must(robots.seal(SessionUuid{{6}}, "cart", kAckChannel, message, kNow).empty());
  }

  ingest::SealedRobots robots{kBoot, kSecret, kStart};
  publishing::SealedDaemon daemon{key(), kRun};

 private:
  void send_many_sessions(const ingest::SealedRobots::Opened& from) {
    for (std::uint8_t i = 0; i < ingest::SealedRobots::kMaxSessions; ++i) robots.sends(from, {{100, i}});
  }
  void send_from_many_runs(const Bytes& message) {
    access::Sealer sealer(key().key);
    const auto now_us =
        static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(kNow - kStart).count());
    for (std::uint64_t run = 100; run < 100 + ingest::SealedRobots::kMaxRuns; ++run) {
      Bytes sealed = message;
      sealer.seal(access::SealedBy::kRobot, kGapChannel, kBoot, {key().id, run, now_us, 1}, sealed);
      must(robots.open(kGapChannel, sealed, kNow, 0).ok());
    }
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < kBeginning) return 0;
  const unsigned kind = data[0], flags = data[1];
  const seconds later(static_cast<std::int8_t>(data[2]));
  const std::int64_t utc_s = data[3];
  const Bytes message(data + kBeginning, data + size);
  decode_as(kind, message);
  DaemonStatus status;
  status.version = fuzzing::text_of(ByteSpan(message).first(std::min<std::size_t>(message.size(), 20)));
  status.sessions = message.size();
  must(encode_lcm(status).size() > status.version.size());

  static const storage::TemporaryFolder kFolder;
  const std::string secret = kFolder / "key";
  fuzzing::write_file(secret, message);
  std::filesystem::permissions(secret, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  const auto line = fuzzing::text_of(message).substr(0, fuzzing::text_of(message).find('\n'));
  must(access::read_secret(secret).ok() == access::key_of_hex(line).has_value());

  Exchange exchange;
  exchange.robots.use(access_list(false));
  exchange.take_unsealed(message);
  if (!exchange.meet(message, flags, utc_s - kMeetsBefore_s)) return 0;
  exchange.send(message, flags, later, utc_s);
  exchange.answer(kind, message, flags);
  return 0;
}
