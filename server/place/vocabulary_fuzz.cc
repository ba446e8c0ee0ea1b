// Parses any bytes as a vocabulary file, with the checksum corrected so that the tables behind it are reached.
#include <cstring>

#include "proto/base/crc32c.h"
#include "server/place/vocabulary.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  relmap::Bytes bytes(data, data + size);
  if (size >= 4) {
    const std::uint32_t crc = relmap::crc32c(relmap::ByteSpan(bytes).first(size - 4));
    std::memcpy(bytes.data() + size - 4, &crc, 4);
  }
  const auto vocabulary = relmap::place::Vocabulary::from_bytes(std::move(bytes));
  if (!vocabulary.ok()) return 0;
  // A vocabulary that is accepted must be usable.
  std::vector<relmap::AppearanceFeature> features(2);
  features[1].descriptor.fill(255);
  for (const std::uint32_t word : (*vocabulary)->words(features))
    if (word >= (*vocabulary)->size()) __builtin_trap();
  for (std::size_t i = 0; i < (*vocabulary)->sample_places(); ++i)
    for (const std::uint32_t word : (*vocabulary)->sample_place(i))
      if (word >= (*vocabulary)->size()) __builtin_trap();
  return 0;
}
