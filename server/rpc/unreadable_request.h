// Requests that gRPC cannot parse (bytes that are not a message of the method, or a text that is not UTF-8) never reach
// a handler. gRPC answers them with a bare UNIMPLEMENTED, as if there were no such method; here they get a reason.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

namespace relmap::rpc {

// An interceptor for a ServerBuilder that answers INVALID_ARGUMENT with the method's name instead. It does not apply to
// streams of robots, whose messages are checked one by one.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> name_unreadable_requests();

}  // namespace relmap::rpc
