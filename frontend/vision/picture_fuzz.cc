// Any bytes: the header is parsed, and what declares at most 64 kilopixels is decoded.
#include "frontend/vision/picture.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const relmap::ByteSpan file(data, size);
  const auto declared = relmap::vision::picture_size(file);
  if (!declared.ok()) return 0;
  if (static_cast<double>(declared->width) * declared->height > 65536) return 0;
  const auto picture = relmap::vision::decode_picture(file, 4096);
  if (picture.ok() &&
      (picture->grey.empty() || static_cast<double>(picture->grey.width()) * picture->grey.height() > 4096))
    __builtin_trap();
  return 0;
}
