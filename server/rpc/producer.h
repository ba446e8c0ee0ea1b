// A function that produces the messages of a stream, one after another.
#pragma once

#include <functional>
#include <optional>

#include "proto/base/status.h"

namespace relmap::rpc {

// Returns nullopt after the last message. Called by one thread at a time.
template <typename Reply>
using Producer = std::function<Result<std::optional<Reply>>()>;

}  // namespace relmap::rpc
