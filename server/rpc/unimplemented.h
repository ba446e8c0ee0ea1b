// RPCs that are defined but not served yet. They answer UNIMPLEMENTED with their name, through the gateway like all
// others.
#pragma once

#include "server/rpc/gateway.h"

namespace relmap::rpc {

inline Status unimplemented(const char* method) {
  return {Reason::UNIMPLEMENTED, std::string(method) + " is not served by this version of relmapd"};
}

template <typename Reply, typename Request>
grpc::ServerWriteReactor<Reply>* unimplemented_stream(Gateway& gateway, grpc::CallbackServerContext* context,
                                                      const char* method, const Request* request) {
  return gateway.stream<Reply>(
      context, method, Lane::kGeneral, request,
      [method](const Request&, const Deadline&) -> Result<Producer<Reply>> { return unimplemented(method); });
}

}  // namespace relmap::rpc
