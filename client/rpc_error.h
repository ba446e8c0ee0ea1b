// Turns gRPC's status into ours. Internal to client/ and to adapters that make their own calls.
#pragma once

#include "proto/base/status.h"

namespace grpc {
class Status;
}

namespace relmap::client {

// The daemon's reason and message, from relmap.v1.Error in the status details. Without one, or if the reason is one of
// a later version, the reason that corresponds to gRPC's code.
Status status_of(const grpc::Status& status);

}  // namespace relmap::client
