#include "server/map/background_work.h"

#include <utility>
#include <variant>

#include "proto/base/mutex.h"
#include "server/map/deletion.h"

namespace relmap::map {

BackgroundWork::BackgroundWork(std::uint64_t slice, Hooks hooks) : slice_(slice), hooks_(std::move(hooks)) {}

void BackgroundWork::resume(bool relaxation_pending) {
  const MutexLock lock(mutex_);
  relaxation_pending_ = relaxation_pending;
}

void BackgroundWork::applied(const storage::JournalRecord& record, bool relaxation_pending) {
  const MutexLock lock(mutex_);
  relaxation_pending_ = relaxation_pending;
  if (std::holds_alternative<storage::IdleWorkRecord>(record)) relaxation_on_its_way_ = false;
  if (std::holds_alternative<storage::RemoveChunkRecord>(record)) removal_on_its_way_ = false;
}

void BackgroundWork::forget_relaxation() {
  const MutexLock lock(mutex_);
  relaxation_pending_ = false;
}

void BackgroundWork::delete_session(SessionNumber session) {
  const MutexLock lock(mutex_);
  going_.insert(session);
}

void BackgroundWork::submit_next() {
  bool overdue = false, remove = false;
  {
    const MutexLock lock(mutex_);
    overdue = std::chrono::steady_clock::now() - relaxed_at_ > kLeastOften;
    remove = !removal_on_its_way_;
  }
  if (relaxation_waits() && hooks_.is_quiet() && (overdue || hooks_.lookups_keep_up())) {
    submit(storage::IdleWorkRecord{slice_}, &BackgroundWork::relaxation_on_its_way_);
    const MutexLock lock(mutex_);
    relaxed_at_ = std::chrono::steady_clock::now();
  }
  if (!remove || !hooks_.is_quiet()) return;
  if (const auto removal = next_removal()) submit(*removal, &BackgroundWork::removal_on_its_way_);
}

void BackgroundWork::submit(storage::JournalRecord record, bool BackgroundWork::*on_its_way) {
  {
    const MutexLock lock(mutex_);
    this->*on_its_way = true;
  }
  const Done done = [this, on_its_way](const Result<std::uint64_t>& result) {
    if (result.ok()) return;  // until it is applied
    const MutexLock lock(mutex_);
    this->*on_its_way = false;
  };
  if (Status status = hooks_.submit(std::move(record), done); !status.ok()) done(status);
}

std::optional<storage::RemoveChunkRecord> BackgroundWork::next_removal() {
  while (hooks_.may_remove()) {
    SessionNumber session = 0;
    {
      const MutexLock lock(mutex_);
      if (going_.empty()) break;
      session = *going_.begin();
    }
    if (const auto next = next_deletion(*hooks_.session(session)))
      return hooks_.has_waiting_lookups(session) ? std::nullopt : next;
    hooks_.on_gone(session);
    const MutexLock lock(mutex_);
    going_.erase(session);
  }
  return std::nullopt;
}

bool BackgroundWork::removal_is_held_back() const {
  {
    const MutexLock lock(mutex_);
    if (going_.empty()) return false;
  }
  return !hooks_.may_remove();
}

bool BackgroundWork::relaxation_waits() const {
  const MutexLock lock(mutex_);
  return relaxation_pending_ && !relaxation_on_its_way_;
}

bool BackgroundWork::done() const {
  const MutexLock lock(mutex_);
  return !relaxation_pending_ && !relaxation_on_its_way_ && going_.empty();
}

}  // namespace relmap::map
