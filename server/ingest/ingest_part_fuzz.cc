// Takes in what arrives on the channels of ingest, as the daemon does. The first byte says what the rest is: one
// message of any bytes, with its checksums as they are or corrected; or several messages and keyframes to the same
// daemon, the latter cut into parts whose checksums are right, of which any arrive, in any order.
#include <chrono>
#include <optional>

#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/lcm_messages.h"
#include "server/intake/intake.h"
#include "server/intake/testing/fake_sink.h"

namespace {

using namespace relmap;
using fuzzing::must;

enum Kind : std::uint8_t { kGap, kAcknowledgement, kPart, kMendedPart, kSeveral, kKinds };

constexpr std::size_t kBudget = std::size_t{32} << 20;
constexpr std::size_t kSmallBudget = std::size_t{8} << 20;  // unfinished keyframes may have a sixteenth, and make way
constexpr std::uint32_t kRobots = 4;

class Ingest {
 public:
  explicit Ingest(std::size_t budget) : budget_(budget) {}

  void take(const KeyframePart& part) {
    intake_.take_part(part, now());
    after();
  }
  void take(const Gap& gap) {
    (void)intake_.take_gap(gap, now());
    after();
  }
  void take(const SessionEnd& end) {
    (void)intake_.take_end(end, now());
    after();
  }
  void wait(std::chrono::seconds time) {
    time_ += time;
    after();
  }
  // From now on nothing becomes durable, or all does again.
  void let_sync(bool sync) { syncs_ = sync; }

 private:
  intake::SteadyTime now() { return time_ += std::chrono::milliseconds(10); }
  void after() {
    if (syncs_) sink_.sync();
    for (const Acknowledgement& ack : intake_.poll(now())) must(decode_lcm_acknowledgement(encode_lcm(ack)).ok());
    for (const PoseNews& news : intake_.take_news()) must(decode_lcm_pose(encode_lcm(news)).ok());
    must(sink_.faults.empty() && budget_.used() <= budget_.limit());
  }

  intake::FakeSink sink_;
  storage::Budget budget_;
  intake::Intake intake_{sink_, budget_, {}, {}, [] {}};
  intake::SteadyTime time_{std::chrono::hours(1)};
  bool syncs_ = true;
};

void take_message(Ingest& ingest, unsigned kind, ByteSpan message) {
  if (kind == kGap) {
    if (const auto gap = decode_lcm_gap(message); gap.ok()) ingest.take(*gap);
    return;
  }
  if (kind == kAcknowledgement) {
    (void)decode_lcm_acknowledgement(message);
    return;
  }
  auto part = decode_lcm_part(message);
  if (!part.ok()) return;
  if (kind == kMendedPart) {
    if (part->parts == 1) part->payload_crc = crc32c(part->data);
    part->part_crc = part_checksum(*part);
  }
  ingest.take(*part);
  ingest.take(*part);
}

// A keyframe that passes every check, or any bytes, in parts of any size. Of these arrive as many as a byte says, the
// first one chosen by another byte, and each further one so many behind it as a third one says.
void take_parts(Ingest& ingest, ByteReader& in) {
  static const Keyframe kSample = sample_keyframe();
  const auto how = in.get<std::uint8_t>();
  Keyframe keyframe = kSample;
  keyframe.session.uuid.bytes.fill(static_cast<std::uint8_t>(1 + how % kRobots));
  keyframe.sequence = in.get<std::uint8_t>();
  keyframe.time_us += std::int64_t{1'000'000} * keyframe.sequence;
  keyframe.picture = {0xff, 0xd8, 0xff, in.get<std::uint8_t>()};
  keyframe.tracks.clear();
  for (AppearanceFeature& feature : keyframe.appearance) feature.track = -1;
  if ((how & 16u) != 0) keyframe.picture.resize(kMaxKeyframePictureBytes);
  Bytes payload = encode_keyframe(keyframe);
  if ((how & 32u) != 0) {
    const ByteSpan bytes = fuzzing::take_up_to(in, in.get<std::uint16_t>());
    payload.assign(bytes.begin(), bytes.end());
    if ((how & 64u) != 0) payload.resize(kMaxKeyframeBytes);
    if (payload.empty()) return;
  }
  std::uint32_t crc = crc32c(payload);
  if (how >= 224) crc ^= 1u;
  const std::uint32_t part_bytes = kMinPartBytes + 64u * in.get<std::uint8_t>();
  const std::uint32_t parts = count_parts(payload.size(), part_bytes);
  const std::uint32_t arrive = in.get<std::uint8_t>(), step = in.get<std::uint8_t>();
  std::uint32_t index = in.get<std::uint8_t>();
  for (std::uint32_t n = 0; n < arrive; ++n, index += step)
    ingest.take(cut_part(keyframe.session.uuid, keyframe.sequence, payload, crc, part_bytes, index % parts));
}

void take_several(Ingest& ingest, ByteReader in) {
  while (in.ok() && in.remaining() > 0) {
    const auto what = in.get<std::uint8_t>();
    SessionUuid session;
    session.bytes.fill(static_cast<std::uint8_t>(1 + what / 16u % kRobots));
    switch (what % 16) {
      case 0:
      case 1:
      case 2:
      case 3:
        take_message(ingest, what % 16, fuzzing::take_up_to(in, in.get<std::uint16_t>()));
        break;
      case 4: {
        const std::uint32_t from = in.get<std::uint8_t>();
        ingest.take(Gap{session, from, from + in.get<std::uint8_t>(), Reason::DROPPED_BY_ROBOT});
        break;
      }
      case 5:
        ingest.take(SessionEnd{session, in.get<std::uint8_t>()});
        break;
      case 6:
        ingest.wait(std::chrono::seconds(in.get<std::uint8_t>()));
        break;
      case 7:
        ingest.let_sync(what >= 128);
        break;
      default:
        take_parts(ingest, in);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const unsigned kind = data[0] % kKinds;
  const ByteSpan rest(data + 1, size - 1);
  Ingest ingest(kind == kSeveral ? kSmallBudget : kBudget);
  if (kind == kSeveral)
    take_several(ingest, ByteReader(rest));
  else
    take_message(ingest, kind, rest);
  return 0;
}
