#include "server/map/camera_doubts.h"

namespace relmap {

bool CameraDoubts::contradict(SessionNumber session, const Status& contradiction) {
  const std::lock_guard lock(mutex_);
  CameraDoubt& doubt = sessions_[session];
  doubt.session = session;
  doubt.message = contradiction.message();
  return ++doubt.contradicted == kFewest;
}

void CameraDoubts::confirm(SessionNumber session) {
  const std::lock_guard lock(mutex_);
  if (const auto found = sessions_.find(session); found != sessions_.end()) ++found->second.confirmed;
}

void CameraDoubts::forget(SessionNumber session) {
  const std::lock_guard lock(mutex_);
  sessions_.erase(session);
}

std::vector<CameraDoubt> CameraDoubts::doubts() const {
  const std::lock_guard lock(mutex_);
  std::vector<CameraDoubt> doubts;
  for (const auto& [session, doubt] : sessions_)
    if (doubt.contradicted >= kFewest && doubt.contradicted >= doubt.confirmed) doubts.push_back(doubt);
  return doubts;
}

}  // namespace relmap
