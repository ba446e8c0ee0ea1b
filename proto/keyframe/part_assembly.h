// The way back from cut_part(): one version of a keyframe, from its parts in any order, doubled ones among them.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/keyframe/ingest_messages.h"

namespace relmap {

class PartAssembly {
 public:
  // For the keyframe of this part, which has passed check_part() and is yet to be added.
  explicit PartAssembly(const KeyframePart& part);

  // False: the same version cut into other parts, by a front-end that was started again with other options.
  bool fits(const KeyframePart& part) const;
  // A part that fits. True if it was the last one missing: bytes() is the payload, its checksum not compared yet.
  bool add(const KeyframePart& part);

  const std::vector<bool>& present() const { return present_; }  // by part
  Bytes& bytes() { return bytes_; }

 private:
  Bytes bytes_;
  std::vector<bool> present_;
  std::uint32_t missing_;
  std::uint32_t part_bytes_;
};

}  // namespace relmap
