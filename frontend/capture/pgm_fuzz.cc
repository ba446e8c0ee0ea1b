// Any bytes as a grey map: what is decoded is as large as the header says, and never larger than the file.
#include <cstdlib>

#include "frontend/capture/pgm.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const relmap::ByteSpan file(data, size);
  if (!relmap::capture::is_pgm(file)) return 0;
  const auto header = relmap::capture::read_pgm_header(file);
  const auto image = relmap::capture::decode_pgm(file);
  if (header.ok() != image.ok()) std::abort();
  if (!image.ok()) return 0;
  if (image->width() != header->width || image->height() != header->height) std::abort();
  if (static_cast<std::size_t>(image->width()) * static_cast<std::size_t>(image->height()) > size) std::abort();
  return 0;
}
