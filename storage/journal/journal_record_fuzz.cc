#include <cstdlib>

#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"
#include "storage/journal/journal_record.h"

namespace {

using relmap::Bytes;
using relmap::ByteSpan;
using namespace relmap::storage;

// What decodes must encode to bytes that decode to the same again.
void round_trip(ByteSpan bytes) {
  if (const auto decoded = decode_record(bytes); decoded.ok()) {
    const Bytes once = encode_record(decoded->record, decoded->acknowledged_through);
    const auto again = decode_record(once);
    if (!again.ok() || encode_record(again->record, again->acknowledged_through) != once) std::abort();
  }
  if (const auto session = decode_session(bytes); session.ok() && !decode_session(encode_session(*session)).ok())
    std::abort();
  if (const auto state = decode_state(bytes); state.ok() && !decode_state(encode_state(*state)).ok()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  round_trip(bytes);
  if (size == 0) return 0;
  // Random bytes do not pass the checksum, so they are sealed as records without and with extensions, sessions and
  // state.
  for (const std::uint16_t version : {1, 2, 4}) round_trip(seal(data[0], version, bytes.subspan(1)));
  return 0;
}
