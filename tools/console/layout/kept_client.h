// A connection to the daemon that is kept as long as it works and its credentials are those that hold.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "client/relmap_client.h"
#include "proto/base/mutex.h"

namespace relmap::console {

// Thread-safe.
class KeptClient {
 public:
  // Makes a connection, with the credentials that are good by then.
  using Connect = std::function<Result<std::unique_ptr<client::Client>>()>;
  // What tells these credentials from others. Empty function: they never change.
  using Credentials = std::function<std::string()>;
  explicit KeptClient(Connect connect, Credentials credentials = {})
      : connect_(std::move(connect)), credentials_(std::move(credentials)) {}

  // The connection; it is made if there is none, or other credentials hold than when it was made.
  Result<std::shared_ptr<client::Client>> get();
  // The next call has a new one, with the credentials of then: this one may have broken, or its token been revoked.
  void drop();

 private:
  const Connect connect_;
  const Credentials credentials_;
  Mutex mutex_;
  std::shared_ptr<client::Client> client_ RELMAP_GUARDED_BY(mutex_);
  std::string made_with_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::console
