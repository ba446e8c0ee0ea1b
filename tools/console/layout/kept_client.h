// A connection to the daemon that is kept as long as it works.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "client/relmap_client.h"
#include "proto/base/mutex.h"

namespace relmap::console {

// Thread-safe.
class KeptClient {
 public:
  // Makes a connection, with the credentials that are good by then.
  using Connect = std::function<Result<std::unique_ptr<client::Client>>()>;
  explicit KeptClient(Connect connect) : connect_(std::move(connect)) {}

  // The connection; it is made if there is none.
  Result<std::shared_ptr<client::Client>> get();
  // The next call has a new one, with the credentials of then: this one may have broken, or its token been revoked.
  void drop();

 private:
  const Connect connect_;
  Mutex mutex_;
  std::shared_ptr<client::Client> client_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::console
