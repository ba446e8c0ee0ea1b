#include "proto/base/bar_text.h"

#include <algorithm>

namespace relmap {

std::string filled_bar_text(std::uint64_t filled, std::uint64_t width) {
  const std::uint64_t full = std::min(filled, width);
  return '[' + std::string(full, '#') + std::string(width - full, '.') + ']';
}

std::string progress_bar_text(std::uint64_t done, std::uint64_t total, std::uint64_t width) {
  return filled_bar_text(total == 0 ? 0 : width * std::min(done, total) / total, width);
}

}  // namespace relmap
