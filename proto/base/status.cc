#include "proto/base/status.h"

namespace relmap {

std::string Status::to_string() const {
  std::string text(reason_name(reason_));
  if (!message_.empty()) text += ": " + message_;
  return text;
}

}  // namespace relmap
