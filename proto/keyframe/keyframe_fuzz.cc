// For any bytes: decoding terminates, its result can be checked, and can be encoded and decoded again.
#include <cstdint>
#include <cstdlib>

#include "proto/keyframe/keyframe.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto keyframe = relmap::decode_keyframe({data, size});
  if (!keyframe.ok()) return 0;
  const bool sound = relmap::check_keyframe(*keyframe).ok();
  const relmap::Bytes bytes = relmap::encode_keyframe(*keyframe);
  const auto again = relmap::decode_keyframe(bytes);
  if (!again.ok() || bytes.size() != size) std::abort();
  if (sound && (relmap::encode_keyframe(*again) != bytes || !relmap::check_keyframe(*again).ok())) std::abort();
  return 0;
}
