// Which closures a skeleton tells, of those that join the same stretches of frames.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "storage/graph/digest.h"

namespace relmap::skeleton {

// 0 (nothing speaks against it) to 1.
using Suspicion = std::function<double(const storage::ClosureDigest& closure)>;

struct ChosenClosure {
  const storage::ClosureDigest* closure = nullptr;
  float suspicion = 0;
  std::uint32_t alike = 1;  // closures that it stands for, itself included
};

// Of the closures of one chunk: all if `stride` is 1. Otherwise two are alike that join the same stretches of `stride`
// frames (aligned to multiples of it) and have the same state, and of those that are alike the most certain one is
// told, and every one that is suspicious (proto/base/suspicion.h). In the order given, which must be that of their ids.
std::vector<ChosenClosure> choose_closures(const std::vector<const storage::ClosureDigest*>& closures,
                                           std::uint32_t stride, const Suspicion& suspicion);

}  // namespace relmap::skeleton
