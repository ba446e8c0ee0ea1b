// The Map service as it stands on the wire, for questions that the client library does not put.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "proto/status.h"
#include "relmap/v1/map.grpc.pb.h"

namespace relmap::testing {

class MapStub {
 public:
  explicit MapStub(const std::string& address);

  template <typename Request, typename Reply>
  using Method = grpc::Status (v1::Map::Stub::*)(grpc::ClientContext*, const Request&, Reply*);
  template <typename Request, typename Reply>
  Result<Reply> ask(Method<Request, Reply> method, const Request& request) {
    grpc::ClientContext context;
    Reply reply;
    if (const Status status = status_of((stub_.get()->*method)(&context, request, &reply)); !status.ok()) return status;
    return reply;
  }

  Result<v1::GetStatusReply> status() { return ask(&v1::Map::Stub::GetStatus, v1::GetStatusRequest()); }
  // All messages as one; the tokens left out.
  Result<v1::FindRouteReply> find_route(const v1::FindRouteRequest& request);

 private:
  static Status status_of(const grpc::Status& status);
  std::unique_ptr<v1::Map::Stub> stub_;
};

}  // namespace relmap::testing
