// Any text as a configuration file: it is refused by name, or gives settings that can be checked.
#include <cstdint>
#include <string_view>

#include "server/ops/config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  relmap::ops::Config config;
  const relmap::Status read =
      relmap::ops::parse_config({reinterpret_cast<const char*>(data), size}, "relmapd.yaml", config);
  if (!read.ok() && (read.reason() != relmap::Reason::BAD_CONFIG || !read.message().starts_with("relmapd.yaml:")))
    __builtin_trap();
  relmap::ops::complete_config(config);
  config.lcm.clear();  // a log would be looked for on the disk
  (void)relmap::ops::check_config(config);
  return 0;
}
