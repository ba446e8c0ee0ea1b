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
  std::uint16_t port = 0;  // 0 means any free port
};

class RpcServer {
 public:
  // Starts a server, which serves when this returns. `core` must outlive it. PORT_IN_USE.
  static Result<std::unique_ptr<RpcServer>> start(Core& core, const ServerOptions& options);
  // Stops without patience.
  ~RpcServer();

  std::uint16_t port() const;

  // Stops the server: health reports NOT_SERVING, new calls are refused, and running ones are interrupted. Calls that
  // have not ended after `patience` are cut off.
  void stop(std::chrono::milliseconds patience);

 private:
  struct Impl;
  explicit RpcServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::rpc
