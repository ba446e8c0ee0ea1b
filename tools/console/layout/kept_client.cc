#include "tools/console/layout/kept_client.h"

namespace relmap::console {

Result<std::shared_ptr<client::Client>> KeptClient::get() {
  {
    const MutexLock lock(mutex_);
    if (client_) return client_;
  }
  auto made = connect_();
  if (!made.ok()) return made.status();
  const MutexLock lock(mutex_);
  if (!client_) client_ = *std::move(made);
  return client_;
}

void KeptClient::drop() {
  const MutexLock lock(mutex_);
  client_ = nullptr;
}

}  // namespace relmap::console
