#include "proto/keyframe/part_assembly.h"

#include <algorithm>

namespace relmap {

PartAssembly::PartAssembly(const KeyframePart& part)
    : bytes_(part.total_bytes), present_(part.parts), missing_(part.parts), part_bytes_(regular_part_bytes(part)) {}

bool PartAssembly::fits(const KeyframePart& part) const {
  return bytes_.size() == part.total_bytes && present_.size() == part.parts && part_bytes_ == regular_part_bytes(part);
}

bool PartAssembly::add(const KeyframePart& part) {
  if (present_[part.part]) return false;
  present_[part.part] = true;
  std::copy(part.data.begin(), part.data.end(), bytes_.begin() + part.offset);
  return --missing_ == 0;
}

}  // namespace relmap
