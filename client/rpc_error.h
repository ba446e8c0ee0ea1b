// What a failed call means. Internal to client/ and to the adapters that make calls of their own.
#pragma once

#include "proto/base/status.h"

namespace grpc {
class Status;
}

namespace relmap::client {

// The daemon's own reason, from relmap.v1.Error in the status details; without one, the nearest reason of the code.
Status status_of(const grpc::Status& status);

}  // namespace relmap::client
