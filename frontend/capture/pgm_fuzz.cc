// Any bytes as a grey map: what is decoded is as large as the header says, and never larger than the file.
#include "frontend/capture/pgm.h"
#include "proto/base/testing/fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using fuzzing::must;
  const ByteSpan file(data, size);
  if (!capture::is_pgm(file)) return 0;
  const auto header = capture::read_pgm_header(file);
  const auto image = capture::decode_pgm(file);
  must(header.ok() == image.ok());
  if (!image.ok()) return 0;
  must(image->width() == header->width && image->height() == header->height);
  must(static_cast<std::size_t>(image->width()) * static_cast<std::size_t>(image->height()) <= size);
  return 0;
}
