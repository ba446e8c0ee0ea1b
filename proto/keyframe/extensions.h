// Extensions are what later versions add to a record: tagged bytes behind the record's own fields
// (docs/storage-format.md, Extensions). A reader that does not know a tag keeps its bytes and writes them again, so
// that an older version passes on the whole record.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/base/bytes.h"

namespace relmap {

struct Extension {
  std::uint32_t tag = 0;  // from 1; each kind of record has its own tags
  Bytes bytes;

  bool operator==(const Extension&) const = default;
};
using Extensions = std::vector<Extension>;  // ascending by tag, each tag once

}  // namespace relmap
