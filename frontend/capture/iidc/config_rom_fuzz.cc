#include <cstdint>
#include <cstring>
#include <vector>

#include "frontend/capture/iidc/config_rom.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint32_t> quadlets(size / 4);
  if (!quadlets.empty()) std::memcpy(quadlets.data(), data, 4 * quadlets.size());
  (void)relmap::iidc::parse_config_rom(quadlets);
  return 0;
}
