// Statuses whose messages are put together of texts and numbers.
#pragma once

#include <sstream>

#include "proto/base/status.h"

namespace relmap {

// A status whose message is `parts`, streamed one after the other.
template <typename... Parts>
Status refuse(Reason reason, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return {reason, text.str()};
}

}  // namespace relmap
