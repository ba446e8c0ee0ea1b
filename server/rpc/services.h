// The three gRPC services over a Core. They only connect each RPC with the gateway and its handler.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>

#include "server/rpc/core.h"
#include "server/rpc/gateway.h"

namespace relmap::rpc {

// What the methods of a service take and return.
using Context = grpc::CallbackServerContext;
using Unary = grpc::ServerUnaryReactor;
template <typename Reply>
using Stream = grpc::ServerWriteReactor<Reply>;

std::unique_ptr<grpc::Service> make_map_service(Core& core, Gateway& gateway);
std::unique_ptr<grpc::Service> make_ingest_service(Core& core, Gateway& gateway);
std::unique_ptr<grpc::Service> make_admin_service(Core& core, Gateway& gateway);

}  // namespace relmap::rpc
