// What gRPC shows of a caller, and the check that turns away those who are nobody before their request is read.
#pragma once

#include <grpcpp/security/auth_metadata_processor.h>
#include <grpcpp/server_context.h>

#include <memory>

#include "server/rpc/gatekeeper.h"

namespace relmap::rpc {

// The texts live as long as the call's context.
Evidence evidence_of(const grpc::CallbackServerContext& context, const grpc::AuthContext& connection);

// Answers UNAUTHENTICATED to all callers that the gatekeeper does not know. `health`: but for calls of gRPC's health
// service, for callers of this machine. `gatekeeper` must outlive it.
std::shared_ptr<grpc::AuthMetadataProcessor> turn_strangers_away(const Gatekeeper& gatekeeper, bool health);

}  // namespace relmap::rpc
