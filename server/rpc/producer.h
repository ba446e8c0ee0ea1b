// The messages of a stream, taken one after another.
#pragma once

#include <functional>
#include <optional>

#include "proto/base/status.h"

namespace relmap::rpc {

// nullopt: that was all. Called by one thread at a time.
template <typename Reply>
using Producer = std::function<Result<std::optional<Reply>>()>;

}  // namespace relmap::rpc
