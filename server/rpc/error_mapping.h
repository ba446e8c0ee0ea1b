// How a Reason travels: as gRPC's nearest status code, with relmap.v1.Error in grpc-status-details-bin.
#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "proto/base/status.h"

namespace relmap::rpc {

grpc::StatusCode status_code(Reason reason);

// `request_id` is what the log calls the call.
grpc::Status to_grpc(const Status& status, const std::string& request_id);

}  // namespace relmap::rpc
