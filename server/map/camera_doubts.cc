#include "server/map/camera_doubts.h"

#include <algorithm>
#include <set>

#include "proto/base/mutex.h"

namespace relmap::map {

namespace {

std::pair<SessionNumber, SessionNumber> ascending(SessionNumber a, SessionNumber b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

std::optional<CameraDoubt> CameraDoubts::contradict(SessionNumber session, SessionNumber with,
                                                    const std::string& message) {
  const MutexLock lock(mutex_);
  const auto before = doubts_locked();
  Pair& pair = pairs_[ascending(session, with)];
  ++pair.contradicted;
  pair.message = message;
  for (const CameraDoubt& doubt : doubts_locked()) {
    const bool known =
        std::any_of(before.begin(), before.end(), [&](const CameraDoubt& d) { return d.session == doubt.session; });
    if (!known) return doubt;
  }
  return std::nullopt;
}

void CameraDoubts::confirm(SessionNumber session, SessionNumber with) {
  if (session == with) return;  // a wrong calibration agrees with itself
  const MutexLock lock(mutex_);
  ++pairs_[ascending(session, with)].confirmed;
}

void CameraDoubts::forget(SessionNumber session) {
  const MutexLock lock(mutex_);
  std::erase_if(pairs_, [&](const auto& pair) { return pair.first.first == session || pair.first.second == session; });
}

std::vector<CameraDoubt> CameraDoubts::doubts() const {
  const MutexLock lock(mutex_);
  return doubts_locked();
}

std::vector<CameraDoubt> CameraDoubts::doubts_locked() const {
  std::set<Sessions> contradictions;
  std::map<SessionNumber, int> balance;  // number of sessions that it contradicts, less those that it confirms
  for (const auto& [sessions, pair] : pairs_) {
    const auto [a, b] = sessions;
    const bool contradict = pair.contradicted >= kMinKeyframes && pair.contradicted >= pair.confirmed;
    if (contradict) contradictions.insert(sessions);
    balance[a] += contradict ? 1 : -1;
    if (a != b) balance[b] += contradict ? 1 : -1;
  }
  std::vector<CameraDoubt> doubts;
  while (!contradictions.empty()) {
    SessionNumber worst = 0;
    for (const auto& [a, b] : contradictions)
      for (const SessionNumber session : {a, b})
        if (worst == 0 || balance[session] > balance[worst] || (balance[session] == balance[worst] && session > worst))
          worst = session;
    CameraDoubt doubt;
    doubt.session = worst;
    std::erase_if(contradictions, [&](const Sessions& sessions) RELMAP_REQUIRES(mutex_) {
      const auto [a, b] = sessions;
      if (a != worst && b != worst) return false;
      const Pair& pair = pairs_.at(sessions);
      doubt.against.push_back(a == worst ? b : a);
      doubt.contradicted += pair.contradicted;
      doubt.message = pair.message;
      if (a != b) --balance[doubt.against.back()];
      return true;
    });
    std::sort(doubt.against.begin(), doubt.against.end());
    doubts.push_back(std::move(doubt));
  }
  std::sort(doubts.begin(), doubts.end(), [](const auto& x, const auto& y) { return x.session < y.session; });
  return doubts;
}

}  // namespace relmap::map
