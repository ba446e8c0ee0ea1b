// What a later version adds to a record: tagged, each with its length, behind the record's own fields
// (docs/storage-format.md, Extensions). A reader that does not know a tag keeps its bytes and writes them again, so
// that a record loses nothing by passing through an older version.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/base/bytes.h"

namespace relmap {

struct Extension {
  std::uint32_t tag = 0;  // 1 and above; what it means is a matter of the record
  Bytes bytes;

  bool operator==(const Extension&) const = default;
};
using Extensions = std::vector<Extension>;  // ascending by tag, each tag once

}  // namespace relmap
