// The generated stub of the Map service, for requests that the client library cannot make.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "proto/base/status.h"
#include "relmap/v1/map.grpc.pb.h"

namespace relmap::testing {

class MapStub {
 public:
  explicit MapStub(const std::string& address);

  template <typename Request, typename Reply>
  using Method = grpc::Status (v1::Map::Stub::*)(grpc::ClientContext*, const Request&, Reply*);
  template <typename Request, typename Reply>
  Result<Reply> ask(Method<Request, Reply> method, const Request& request) {
    return patiently<Reply>(
        [&](grpc::ClientContext* context, Reply* reply) { return (stub_.get()->*method)(context, request, reply); });
  }

  Result<v1::GetStatusReply> status() { return ask(&v1::Map::Stub::GetStatus, v1::GetStatusRequest()); }
  // All messages of the reply merged into one, without tokens.
  Result<v1::FindRouteReply> find_route(const v1::FindRouteRequest& request);

 private:
  // Retries: a small memory budget has room for few replies at a time, including those that gRPC has not freed yet.
  template <typename Reply, typename Call>
  static Result<Reply> patiently(Call call) {
    for (int patience = 100;; --patience) {
      grpc::ClientContext context;
      Reply reply;
      const Status status = status_of(call(&context, &reply));
      if (status.ok()) return reply;
      if (status.reason() != Reason::BUDGET_EXCEEDED || patience == 0) return status;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  static Status status_of(const grpc::Status& status);
  std::unique_ptr<v1::Map::Stub> stub_;
};

}  // namespace relmap::testing
