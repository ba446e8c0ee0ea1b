// Reassembles one version of a keyframe from the parts that cut_part() made, in any order, with repeats.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/keyframe/ingest_messages.h"

namespace relmap {

class PartAssembly {
 public:
  // For the keyframe of `part`, which must have passed check_part(). Does not add the part.
  explicit PartAssembly(const KeyframePart& part);

  // False if `part` cuts the keyframe differently: a front-end was restarted with other options.
  bool fits(const KeyframePart& part) const;
  // Adds a part that fits(). True if it was the last one missing: bytes() is then the payload, whose checksum the
  // caller has to compare.
  bool add(const KeyframePart& part);

  const std::vector<bool>& present() const { return present_; }  // for each part, whether it was added
  Bytes& bytes() { return bytes_; }

 private:
  Bytes bytes_;
  std::vector<bool> present_;
  std::uint32_t missing_;
  std::uint32_t part_bytes_;
};

}  // namespace relmap
