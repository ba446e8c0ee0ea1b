// Any bytes as a recorded log: sessions are found, and their keyframes come in order. The bytes are a log as they are;
// and they say what is recorded in another one, whose parts and payloads have right checksums: keyframes of two
// sessions that were cut into parts, in any order and with parts missing, gaps, and other bytes between them.
#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "frontend/recording/keyframe_log.h"
#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::recording;
using fuzzing::must;

constexpr std::uint32_t kFirst = 40;  // sequence of both sessions

SessionUuid uuid_of(unsigned session) {
  SessionUuid uuid;
  uuid.bytes[0] = static_cast<std::uint8_t>(1 + session);
  return uuid;
}

// A keyframe of either session; there are several versions of each, of which some have another camera.
Keyframe keyframe_of(unsigned session, std::uint32_t sequence, unsigned version) {
  static const Keyframe kSample = sample_keyframe();
  Keyframe keyframe = kSample;
  keyframe.session.uuid = uuid_of(session);
  if (session > 0) keyframe.session.name = "evening";
  if (version == 2) keyframe.session.camera.cx += 1;
  if (version == 3) keyframe.sequence = sequence + 1;  // not what its parts say
  keyframe.tracks.clear();
  for (AppearanceFeature& feature : keyframe.appearance) feature.track = -1;
  keyframe.time_us += version;
  if (version != 3) keyframe.sequence = sequence;
  return keyframe;
}

class Log {
 public:
  void add_bytes(ByteSpan bytes) { w_.put_bytes(bytes); }
  void add(const std::string& channel, ByteSpan data) {
    put(0xeda1da01);
    for (const std::uint32_t half : {0u, ++number_, 0u, number_}) put(half);  // number and time
    put(static_cast<std::uint32_t>(channel.size()));
    put(static_cast<std::uint32_t>(data.size()));
    w_.put_bytes(as_bytes(channel));
    w_.put_bytes(data);
  }
  void add_parts(const SessionUuid& session, std::uint32_t sequence, ByteSpan payload, std::uint32_t part_bytes,
                 const std::vector<std::uint32_t>& which) {
    for (const std::uint32_t part : which)
      add(kKeyframeChannel, encode_lcm(cut_part(session, sequence, payload, crc32c(payload), part_bytes, part)));
  }
  const Bytes& bytes() const { return w_.bytes(); }

 private:
  void put(std::uint32_t big_endian) {
    for (const int shift : {24, 16, 8, 0}) w_.put(static_cast<std::uint8_t>(big_endian >> shift));
  }
  ByteWriter w_;
  std::uint32_t number_ = 0;
};

// Each message is a byte that says what it is, one for its sequence, and what it needs besides.
void record_message(Log& log, ByteReader& in) {
  const auto how = in.get<std::uint8_t>();
  const std::uint32_t sequence = kFirst + in.get<std::uint8_t>();
  const unsigned session = how / 8u % 2, version = how / 16u % 4;
  const std::uint32_t part_bytes = how >= 128 ? kNetworkPartBytes : kMinPartBytes;
  const auto all_parts = [&](ByteSpan payload) {
    std::vector<std::uint32_t> which(count_parts(payload.size(), part_bytes));
    for (std::uint32_t i = 0; i < which.size(); ++i) which[i] = i;
    return which;
  };
  const auto keyframe = [&] { return encode_keyframe(keyframe_of(session, sequence, version)); };
  switch (how % 8) {
    case 0: {
      const Bytes payload = keyframe();
      return log.add_parts(uuid_of(session), sequence, payload, part_bytes, all_parts(payload));
    }
    case 1: {
      const Bytes payload = keyframe();
      const auto part = in.get<std::uint8_t>() % count_parts(payload.size(), part_bytes);
      return log.add_parts(uuid_of(session), sequence, payload, part_bytes, {part});
    }
    case 2: {
      const Bytes payload = keyframe();
      auto parts = all_parts(payload);
      std::reverse(parts.begin(), parts.end());
      return log.add_parts(uuid_of(session), sequence, payload, part_bytes, parts);
    }
    case 3:
      return log.add(kGapChannel, encode_lcm(Gap{uuid_of(session), sequence, sequence + in.get<std::uint8_t>(),
                                                 Reason::DROPPED_BY_ROBOT}));
    case 4: {  // a payload that is no keyframe
      const ByteSpan payload = fuzzing::take_up_to(in, in.get<std::uint16_t>());
      if (payload.empty()) return;
      return log.add_parts(uuid_of(session), sequence, payload, part_bytes, all_parts(payload));
    }
    case 5: {  // a part that passes its own checksum only
      const Bytes payload = keyframe();
      KeyframePart part = cut_part(uuid_of(session), sequence, payload, ~crc32c(payload), kMaxPartBytes, 0);
      part.sequence ^= in.get<std::uint8_t>();
      part.part_crc = part_checksum(part);
      return log.add(kKeyframeChannel, encode_lcm(part));
    }
    case 6: {
      const char* const channels[] = {kKeyframeChannel, kGapChannel, kStatusChannel};
      return log.add(channels[version % 3], fuzzing::take_up_to(in, in.get<std::uint16_t>()));
    }
    default:
      return log.add_bytes(fuzzing::take_up_to(in, in.get<std::uint8_t>()));
  }
}

void read_on(KeyframeLog& log) {
  std::int64_t last = -1;
  for (;;) {
    const auto keyframe = log.next();
    if (!keyframe.ok() || !*keyframe) break;
    must((*keyframe)->sequence > last && (*keyframe)->session.uuid == log.session().header.uuid);
    must((*keyframe)->sequence >= log.session().first && (*keyframe)->sequence <= log.session().last);
    last = (*keyframe)->sequence;
  }
  for (const auto& [reason, count] : log.left_out()) must(count > 0);
}

void read_all(const Bytes& bytes) {
  const std::string text(bytes.begin(), bytes.end());
  for (const std::string& choice : {std::string(), std::string("morning"), uuid_of(1).to_string()}) {
    auto log = KeyframeLog::open(EventLog(std::make_unique<std::istringstream>(text), text.size(), "log"), choice);
    if (log.ok()) read_on(*log);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  read_all({bytes.begin(), bytes.end()});

  Log made;
  for (ByteReader in(bytes); in.ok() && in.remaining() > 0;) record_message(made, in);
  read_all(made.bytes());

  static const storage::TemporaryFolder kFolder;
  const std::string path = kFolder / "log";
  fuzzing::write_file(path, made.bytes());
  auto log = KeyframeLog::open(path, "morning");
  must(!log.ok() || is_event_log(path) || log->left_out().empty());
  if (log.ok()) read_on(*log);
  return 0;
}
