// The certificate of the server, read again where it may have changed.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::console {

// Thread-safe.
class TlsFiles {
 public:
  // Files in PEM, which may be one.
  TlsFiles(std::string certificate, std::string key) : certificate_(std::move(certificate)), key_(std::move(key)) {}

  // BAD_CONFIG: the files cannot be read or do not belong together, or others can read the key.
  Status read();
  // The context for a new connection; looks at the files every ten seconds. Those that cannot be used leave the former
  // in force.
  std::shared_ptr<boost::asio::ssl::context> now();

 private:
  const std::string certificate_, key_;
  Mutex mutex_;
  std::shared_ptr<boost::asio::ssl::context> context_ RELMAP_GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point read_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::console
