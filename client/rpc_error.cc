#include "client/rpc_error.h"

#include <grpcpp/support/status.h>

#include <string>

#include "proto/wire/convert.h"

namespace relmap::client {

namespace {

Reason nearest(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::UNAVAILABLE:
      return Reason::UNREACHABLE;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
    case grpc::StatusCode::CANCELLED:
      return Reason::DEADLINE;
    case grpc::StatusCode::UNIMPLEMENTED:
      return Reason::UNIMPLEMENTED;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return Reason::BUDGET_EXCEEDED;
    case grpc::StatusCode::UNAUTHENTICATED:
      return Reason::UNAUTHENTICATED;
    case grpc::StatusCode::PERMISSION_DENIED:
      return Reason::NOT_ALLOWED;
    case grpc::StatusCode::INVALID_ARGUMENT:
      return Reason::INVALID_ARGUMENT;
    default:
      return Reason::INTERNAL;
  }
}

// Failures that the daemon's log tells more about.
std::string where_to_look(const v1::Error& error) {
  const Reason reason = reason_from_wire(error.reason());
  const bool logged = reason == Reason::INTERNAL || reason == Reason::IO_ERROR || reason == Reason::DATA_LOSS;
  return logged && !error.request_id().empty() ? " (request " + error.request_id() + " in relmapd's log)" : "";
}

}  // namespace

Status status_of(const grpc::Status& status) {
  if (status.ok()) return {};
  v1::Error error;
  if (!status.error_details().empty() && error.ParseFromString(status.error_details()) &&
      error.reason() != v1::REASON_OK)
    return {reason_from_wire(error.reason()), error.message() + where_to_look(error)};
  return {nearest(status.error_code()), status.error_message()};
}

}  // namespace relmap::client
