// What the lists that are read page by page have in common.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "proto/base/status.h"

namespace relmap::rpc {

inline constexpr std::size_t kMaxPageBytes = 2u << 20;  // a page ends early beyond it

// How many a page may have: as asked for, `usual` if that is 0, and `max` at most.
inline std::uint32_t page_size(std::uint32_t asked, std::uint32_t usual, std::uint32_t max) {
  return asked == 0 ? usual : std::min(asked, max);
}

inline Status foreign_token() { return {Reason::INVALID_ARGUMENT, "the page token is not one of this list"}; }

}  // namespace relmap::rpc
