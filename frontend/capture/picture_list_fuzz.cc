// Any text as a list of pictures: what is read has names and rising times, and all of it pairs up with itself.
#include <cstdint>
#include <cstdlib>

#include "frontend/capture/picture_list.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const auto unit : {relmap::capture::TimeUnit::kSeconds, relmap::capture::TimeUnit::kNanoseconds}) {
    const auto pictures = relmap::capture::parse_picture_list(text, unit, "folder");
    if (!pictures.ok()) continue;
    if (pictures->empty()) std::abort();
    for (std::size_t i = 0; i < pictures->size(); ++i) {
      if ((*pictures)[i].path == "folder") std::abort();
      if (i > 0 && (*pictures)[i].time_us <= (*pictures)[i - 1].time_us) std::abort();
    }
    const auto timed = relmap::capture::pair_by_time(*pictures, *pictures);
    if (timed.pairs.size() != pictures->size() || !timed.alone.empty()) std::abort();
  }
  return 0;
}
