// TLS of the HTTP server. Internal to server/monitor.
#pragma once

#include <openssl/ssl.h>

#include <boost/asio/ssl/context.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "server/rpc/tls_files.h"

namespace relmap::monitor {

// The files of TLS, read again where they may have changed. Thread-safe.
class TlsContext {
 public:
  explicit TlsContext(rpc::TlsFiles files) : files_(std::move(files)) {}

  // BAD_CONFIG.
  Status read();
  // The context for a new connection. Files that cannot be used leave the former in force.
  std::shared_ptr<boost::asio::ssl::context> now();

 private:
  const rpc::TlsFiles files_;
  Mutex mutex_;
  std::shared_ptr<boost::asio::ssl::context> context_ RELMAP_GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point read_ RELMAP_GUARDED_BY(mutex_);
};

// The certificate that the peer has shown, in PEM; empty: none.
std::string peer_certificate(SSL* ssl);

}  // namespace relmap::monitor
