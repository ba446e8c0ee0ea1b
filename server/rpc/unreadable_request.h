// Requests that gRPC cannot parse, bytes that are no message of the method's or a text that is not UTF-8, never come to
// a handler. gRPC answers them with a bare UNIMPLEMENTED, as if there were no such method; here they get a reason.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

namespace relmap::rpc {

// For a ServerBuilder: INVALID_ARGUMENT by name instead. Streams of a robot have no part in it: their calls have no
// request, and their messages are judged one by one.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> name_unreadable_requests();

}  // namespace relmap::rpc
