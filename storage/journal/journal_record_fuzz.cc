// Any bytes as a record of the journal, or as one of the records that describe the map beside its frames: as they are,
// and sealed as what they may be. What decodes encodes to bytes that decode to the same again.
#include "proto/base/testing/fuzzing.h"
#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"
#include "storage/journal/journal_record.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;

template <typename Decoded>
void round_trip(ByteSpan bytes, Result<Decoded> (*decode)(ByteSpan), Bytes (*encode)(const Decoded&)) {
  const auto decoded = decode(bytes);
  if (!decoded.ok()) {
    must(fuzzing::is_one_of(decoded.reason(), {Reason::CORRUPT, Reason::TRUNCATED, Reason::UNKNOWN_FORMAT_VERSION}));
    return;
  }
  const Bytes once = encode(*decoded);
  const auto again = decode(once);
  must(again.ok() && encode(*again) == once);
}

void try_all(ByteSpan bytes) {
  if (const auto decoded = decode_record(bytes); decoded.ok()) {
    const Bytes once = encode_record(decoded->record, decoded->acknowledged_through);
    const auto again = decode_record(once);
    must(again.ok() && encode_record(again->record, again->acknowledged_through) == once);
    must((edit_key(decoded->record) != nullptr) == (edit_key(again->record) != nullptr));
  }
  round_trip<Session>(bytes, decode_session, encode_session);
  round_trip<Skipped>(bytes, decode_skipped, encode_skipped);
  round_trip<std::uint64_t>(bytes, decode_pending, [](const std::uint64_t& frames) { return encode_pending(frames); });
  round_trip<EditKey>(bytes, decode_edit, encode_edit);
  round_trip<MapState>(bytes, decode_state, encode_state);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  try_all(bytes);
  if (size == 0) return 0;
  // Bytes of chance do not pass the checksum. The first one is the kind of the record; each kind has some of these
  // versions.
  for (const std::uint16_t version : {1, 2, 3, 4}) try_all(seal(data[0], version, bytes.subspan(1)));
  return 0;
}
