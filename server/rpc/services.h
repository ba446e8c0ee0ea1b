// The three gRPC services over a Core: they name each RPC to the gateway and its handler, and do nothing else. What has
// no handler answers UNIMPLEMENTED by name.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <memory>

#include "server/rpc/core.h"
#include "server/rpc/gateway.h"

namespace relmap::rpc {

std::unique_ptr<grpc::Service> make_map_service(Core& core, Gateway& gateway);
std::unique_ptr<grpc::Service> make_ingest_service(Core& core, Gateway& gateway);
std::unique_ptr<grpc::Service> make_admin_service(Core& core, Gateway& gateway);

}  // namespace relmap::rpc
