// Any bytes as each message that comes over LCM, by the daemon's side and by the robot's, with seals and without. The
// first byte chooses the message; an odd second one has it sealed, so that what is behind the seal is reached.
#include <cstdlib>

#include "frontend/publishing/lcm/sealed_daemon.h"
#include "proto/base/hex.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"
#include "server/ingest/sealed_robots.h"

namespace {

using namespace relmap;
using Time = ingest::SealedRobots::Time;

constexpr access::SealKey kSecret{1}, kDrawn{2};
constexpr BootId kBoot{3};
constexpr std::uint64_t kRun = 7, kTime_us = 1'000'000;
const Time kStart{};
const Time kNow = kStart + std::chrono::seconds(1);

void must(bool holds) {
  if (!holds) std::abort();
}

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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const unsigned kind = data[0];
  const bool sealed = data[1] % 2 == 1;
  Bytes datagram(data + 2, data + size);
  decode_as(kind, datagram);

  static const access::RobotKey kKey = access::robot_key(kSecret, kDrawn);
  ingest::SealedRobots robots(kBoot, kSecret, kStart);
  access::AccessList list;
  list.add({access::Grant::Kind::kKey, hex(kDrawn), {access::Role::kRobot, "cart"}, 1000, false});
  robots.use(list);
  publishing::SealedDaemon daemon(kKey, kRun);
  access::Sealer sealer(kKey.key);
  Bytes to_daemon = datagram, to_robot = datagram;
  if (sealed) {
    sealer.seal(access::SealedBy::kRobot, kGapChannel, kBoot, {kKey.id, kRun, kTime_us, 1}, to_daemon);
    sealer.seal(access::SealedBy::kDaemon, kAckChannel, {}, {kKey.id, kRun, kTime_us, 1}, to_robot);
  }
  const auto opened = robots.open(kGapChannel, to_daemon, kNow, 1);
  must(opened.ok() == sealed);  // nobody finds a seal by chance
  if (opened.ok()) must(robots.open(kGapChannel, to_daemon, kNow, 1).reason() == Reason::REPLAYED);
  must(!robots.open_hello(to_daemon, 1).ok());
  const auto heard = daemon.open(kAckChannel, to_robot);
  must(heard.has_value() == sealed);
  if (heard) decode_as(kind, heard->message);
  return 0;
}
