// Any bytes as what map format 1 wrote: what is read of them is written in today's format as a migration does, and can
// be read again. The first byte chooses the kind of record; sessions and state are tried as they are, and sealed.
#include <cmath>

#include "proto/base/testing/fuzzing.h"
#include "storage/format/frame_codec.h"
#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"
#include "storage/graph/precision.h"
#include "storage/migrate/format1.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;

constexpr FrameId kId{3, 577};

void migrate_session(ByteSpan bytes) {
  const auto record = format1::decode_session(bytes);
  if (!record.ok()) return;
  must(decode_session(encode_session(record->session)).ok());
  for (const Skipped& item : record->skipped) must(decode_skipped(encode_skipped(item)).ok());
}

void migrate_state(ByteSpan bytes) {
  const auto state = format1::decode_state(bytes);
  if (state.ok()) must(decode_state(encode_state(*state)).ok());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const ByteSpan bytes(data + 1, size - 1);
  ByteWriter w;
  switch (data[0] % 6) {
    case 0:
      if (auto hot = format1::decode_hot(bytes)) {
        round_estimates(*hot);
        encode_hot(w, kId, *hot);
        must(decode_hot(w.bytes(), kId).has_value());
      }
      break;
    case 1:
      if (const auto warm = format1::decode_warm(bytes)) {
        encode_warm(w, kId, *warm);
        must(decode_warm(w.bytes(), kId).has_value());
      }
      break;
    case 2:
      if (const auto cold = format1::decode_cold(bytes)) {
        encode_cold(w, *cold);
        must(decode_cold(w.bytes()).has_value());
      }
      break;
    case 3:
      if (const auto words = format1::decode_words(bytes)) {
        encode_words(w, *words);
        must(decode_words(w.bytes()) == words);
      }
      break;
    case 4:
      migrate_session(bytes);
      for (const std::uint8_t kind : {1, 2}) migrate_session(seal(kind, 1, bytes));
      break;
    default:
      migrate_state(bytes);
      for (const std::uint8_t kind : {1, 2}) migrate_state(seal(kind, 1, bytes));
  }
  return 0;
}
