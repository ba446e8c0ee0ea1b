// Decodes and takes in arbitrary bytes from the channels of ingest, as the daemon does. The first byte chooses the kind
// of message, and whether its checksums are corrected; with wrong checksums hardly anything gets far.
#include "proto/base/crc32c.h"
#include "proto/wire/lcm_messages.h"
#include "server/intake/intake.h"
#include "server/intake/testing/fake_sink.h"

namespace {

constexpr std::size_t kBudget = std::size_t{32} << 20;

class Ingest {
 public:
  void take(const relmap::KeyframePart& part) {
    intake_.take_part(part, now());
    after();
  }
  void take(const relmap::Gap& gap) {
    (void)intake_.take_gap(gap, now());
    after();
  }

 private:
  relmap::intake::SteadyTime now() { return time_ += std::chrono::milliseconds(10); }
  void after() {
    sink_.sync();
    for (const relmap::Acknowledgement& ack : intake_.poll(now()))
      if (!relmap::decode_lcm_acknowledgement(relmap::encode_lcm(ack)).ok()) __builtin_trap();
    if (!sink_.faults.empty() || budget_.used() > budget_.limit()) __builtin_trap();
  }

  relmap::intake::FakeSink sink_;
  relmap::storage::Budget budget_{kBudget};
  relmap::intake::Intake intake_{sink_, budget_, {}, {}, [] {}};
  relmap::intake::SteadyTime time_{std::chrono::hours(1)};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const unsigned mode = data[0];
  const relmap::ByteSpan message(data + 1, size - 1);
  Ingest ingest;
  if (mode % 4 == 0) {
    const auto gap = relmap::decode_lcm_gap(message);
    if (gap.ok()) ingest.take(*gap);
  } else if (mode % 4 == 1) {
    (void)relmap::decode_lcm_acknowledgement(message);
  } else {
    auto part = relmap::decode_lcm_part(message);
    if (!part.ok()) return 0;
    if (mode % 4 == 3) {
      if (part->parts == 1) part->payload_crc = relmap::crc32c(part->data);
      part->part_crc = relmap::part_checksum(*part);
    }
    ingest.take(*part);
    ingest.take(*part);
  }
  return 0;
}
