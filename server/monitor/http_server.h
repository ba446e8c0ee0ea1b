// Serves a few pages over HTTP/1.1, for health checks and Prometheus (Boost.Beast).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "proto/base/status.h"
#include "server/rpc/gatekeeper.h"
#include "server/rpc/tls_files.h"

namespace relmap::monitor {

struct HttpPage {
  unsigned status = 200;
  std::string body;
  std::string type = "text/plain; charset=utf-8";
};

struct HttpOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  // 0: any free one
  // Used unless all addresses of `host` are of this machine itself. Empty certificate: no TLS, and then everyone who
  // can reach the port is served.
  rpc::TlsFiles tls = {};
};

// Callers from this machine need neither credentials nor TLS. Others show a token ("Authorization: Bearer TOKEN") or a
// certificate, of any role, or get 401. At most 32 connections from this machine are open, and as many from elsewhere;
// for one more the oldest of these is closed. A request has 10 s, and a header at most 8 KiB.
class HttpServer {
 public:
  // Returns the page at a path, and for a path without one `status` 404. Called from several threads at a time.
  using Pages = std::function<HttpPage(std::string_view path)>;
  // `gatekeeper` must outlive the server. PORT_IN_USE; BAD_CONFIG (the files of TLS).
  static Result<std::unique_ptr<HttpServer>> start(const HttpOptions& options, const rpc::Gatekeeper& gatekeeper,
                                                   Pages pages);
  // Closes all connections.
  ~HttpServer();

  std::uint16_t port() const;
  bool uses_tls() const;

 private:
  struct Impl;
  explicit HttpServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::monitor
