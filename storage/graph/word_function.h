// How storage makes words without knowing vocabularies.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "proto/keyframe/keyframe.h"

namespace relmap::storage {

// The word of each feature; a Vocabulary's, or none in tests without appearance. Thread-safe.
using WordFunction = std::function<std::vector<std::uint32_t>(std::span<const AppearanceFeature>)>;

}  // namespace relmap::storage
