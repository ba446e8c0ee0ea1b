#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "frontend/capture/dc1394/protocol.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap::iidc::dc1394;
  const std::span bytes(data, size);
  (void)parse_request(bytes);
  if (const auto message = parse_message(bytes);
      message.ok() && message->status().message().size() >= message->text.size())
    std::abort();
  return 0;
}
