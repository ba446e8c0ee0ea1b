// What can be made of a keyframe's record without the map: its fields, and the words that its features show.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"
#include "storage/graph/frame.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

struct PreparedKeyframe {
  Result<Keyframe> keyframe;         // the reasons of decode_keyframe()
  std::vector<std::uint32_t> words;  // of its features, in their order; empty without a vocabulary
};

// `words` may be empty. A pure function.
inline PreparedKeyframe prepare(const storage::KeyframeRecord& record, const storage::WordFunction& words) {
  PreparedKeyframe prepared{decode_keyframe(record.payload), {}};
  if (prepared.keyframe.ok() && words) prepared.words = words(prepared.keyframe->appearance);
  return prepared;
}

}  // namespace relmap::map
