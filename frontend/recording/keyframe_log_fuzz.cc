// Any bytes as a recorded log: sessions are found, and their keyframes come in order.
#include <memory>
#include <sstream>
#include <string>

#include "frontend/recording/keyframe_log.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  for (const char* choice : {"", "morning"}) {
    auto log = relmap::recording::KeyframeLog::open(
        relmap::recording::EventLog(std::make_unique<std::istringstream>(bytes), bytes.size(), "log"), choice);
    if (!log.ok()) continue;
    std::int64_t last = -1;
    for (auto keyframe = log->next(); keyframe.ok() && keyframe->has_value(); keyframe = log->next()) {
      if ((*keyframe)->sequence <= last) __builtin_trap();
      last = (*keyframe)->sequence;
    }
  }
  return 0;
}
