// For any bytes: decoding terminates, its result can be checked, and can be encoded and decoded again.
#include "proto/base/testing/fuzzing.h"
#include "proto/keyframe/keyframe.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using fuzzing::must;
  const auto keyframe = decode_keyframe({data, size});
  if (!keyframe.ok()) return 0;
  const bool sound = check_keyframe(*keyframe).ok();
  const Bytes bytes = encode_keyframe(*keyframe);
  const auto again = decode_keyframe(bytes);
  must(again.ok() && bytes.size() == size);
  must(!sound || (encode_keyframe(*again) == bytes && check_keyframe(*again).ok()));
  return 0;
}
