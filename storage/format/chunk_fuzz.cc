#include <cstdlib>

#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"

namespace {

using relmap::ByteSpan;
using relmap::ByteWriter;
using relmap::FrameId;
using namespace relmap::storage;

constexpr FrameId kId{3, 577};  // the frame of the bodies

// Random bytes do not pass the checksums, so they are tried as bodies of every part. What decodes must encode to bytes
// that decode to the same again.
template <typename Decode, typename Encode>
void round_trip(ByteSpan body, Decode decode, Encode encode) {
  const auto frame = decode(body);
  if (!frame) return;
  ByteWriter once;
  encode(once, *frame);
  const auto again = decode(once.bytes());
  if (!again) std::abort();
  ByteWriter twice;
  encode(twice, *again);
  if (twice.bytes() != once.bytes()) std::abort();
}

void try_body(ByteSpan body) {
  round_trip(
      body, [](ByteSpan b) { return decode_hot(b, kId); },
      [](ByteWriter& w, const FrameHot& f) { encode_hot(w, kId, f); });
  round_trip(
      body, [](ByteSpan b) { return decode_warm(b, kId); },
      [](ByteWriter& w, const FrameWarm& f) { encode_warm(w, kId, f); });
  round_trip(body, decode_cold, encode_cold);
  round_trip(body, decode_words, encode_words);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  try_body(bytes);
  const auto reader = PartReader::open(bytes, Part::kWarm, {3, 9});
  if (!reader.ok()) return 0;
  for (std::size_t i = 0; i < reader->size(); ++i)
    if (const auto body = reader->body(i); body.ok()) try_body(*body);
  return 0;
}
