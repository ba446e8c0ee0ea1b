// The gRPC server: services, health and reflection, at a Unix socket and at a TCP address.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "server/rpc/audit_log.h"
#include "server/rpc/core.h"
#include "server/rpc/gatekeeper.h"
#include "server/rpc/listener.h"
#include "server/rpc/tls_files.h"

namespace relmap::rpc {

struct ServerOptions {
  std::string socket = {};        // path; empty: no socket
  std::string socket_group = {};  // whose members may use the socket, besides its owner; empty: none
  std::string host = {};          // empty: no TCP
  std::uint16_t port = 0;         // 0 means any free port
  TlsFiles tls = {};
  ConnectionLimits connections = {};
  AuditLog* audit = nullptr;            // outlives the server; null: none
  const TlsWatch* tls_watch = nullptr;  // whose state GetStatus tells; outlives the server; null: none
};

class RpcServer {
 public:
  // Starts a server, which serves when this returns. `core` and `gatekeeper` must outlive it. PORT_IN_USE, IO_ERROR
  // (the socket), BAD_CONFIG (its group, or the files of TLS).
  static Result<std::unique_ptr<RpcServer>> start(Core& core, const Gatekeeper& gatekeeper,
                                                  const ServerOptions& options);
  // Stops without patience.
  ~RpcServer();

  std::uint16_t port() const;  // of TCP; 0 without it

  // What gRPC's health service tells of "relmap.v1.Map", "relmap.v1.Ingest", "relmap.v1.Admin", or of the whole ("").
  // All are SERVING at first. Thread-safe.
  void set_serving(const std::string& service, bool serving);
  // From now on health tells NOT_SERVING of everything, while calls go on. Thread-safe.
  void announce_stop();

  // Stops the server: health reports NOT_SERVING, new calls are refused, and running ones are interrupted. Calls that
  // have not ended after `patience` are cut off.
  void stop(std::chrono::milliseconds patience);

 private:
  struct Impl;
  explicit RpcServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::rpc
