// The gRPC server: services, health and reflection on one port.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "server/rpc/core.h"

namespace relmap::rpc {

struct ServerOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  // 0: any free one
};

class RpcServer {
 public:
  // Serves from its return on. PORT_IN_USE. `core` must outlive it.
  static Result<std::unique_ptr<RpcServer>> start(Core& core, const ServerOptions& options);
  // As stop() without patience.
  ~RpcServer();

  std::uint16_t port() const;

  // Health says NOT_SERVING, new calls are refused, running ones see their deadline passed; those that have not ended
  // after `patience` are cut off.
  void stop(std::chrono::milliseconds patience);

 private:
  struct Impl;
  explicit RpcServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::rpc
