#include "proto/base/reason.h"

namespace relmap {

std::string_view reason_name(Reason reason) {
  switch (reason) {
#define X(name, number) \
  case Reason::name:    \
    return #name;
    RELMAP_REASONS(X)
#undef X
  }
  return "UNKNOWN";
}

bool is_reason(std::uint16_t number) { return reason_name(static_cast<Reason>(number)) != "UNKNOWN"; }

}  // namespace relmap
