// Maps a Reason to the closest gRPC status code, with a relmap.v1.Error in grpc-status-details-bin.
#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "proto/base/status.h"

namespace relmap::rpc {

grpc::StatusCode status_code(Reason reason);

// `request_id` identifies the call in the log.
grpc::Status to_grpc(const Status& status, const std::string& request_id);

}  // namespace relmap::rpc
