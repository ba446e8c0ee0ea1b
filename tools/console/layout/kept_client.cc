#include "tools/console/layout/kept_client.h"

namespace relmap::console {

Result<std::shared_ptr<client::Client>> KeptClient::get() {
  const std::string credentials = credentials_ ? credentials_() : std::string();
  {
    const MutexLock lock(mutex_);
    if (client_ && made_with_ == credentials) return client_;
    client_ = nullptr;
  }
  auto made = connect_();
  if (!made.ok()) return made.status();
  const MutexLock lock(mutex_);
  if (client_ && made_with_ == credentials) return client_;  // another thread was faster
  client_ = *std::move(made);
  made_with_ = credentials;
  return client_;
}

void KeptClient::drop() {
  const MutexLock lock(mutex_);
  client_ = nullptr;
}

}  // namespace relmap::console
