#include "server/map/commit_scheduler.h"

#include <spdlog/spdlog.h>

#include <optional>
#include <utility>

#include "proto/base/mutex.h"

namespace relmap::map {

CommitScheduler::CommitScheduler(std::chrono::milliseconds interval, std::shared_ptr<storage::Engine> engine,
                                 std::shared_ptr<storage::Budget> budget, Hooks hooks)
    : interval_(interval), engine_(std::move(engine)), budget_(std::move(budget)), hooks_(std::move(hooks)) {}

std::uint64_t CommitScheduler::ask() {
  std::uint64_t ticket = 0;
  {
    const MutexLock lock(mutex_);
    ticket = ++asked_;
  }
  hooks_.on_change();
  return ticket;
}

bool CommitScheduler::done(std::uint64_t ticket) const {
  const MutexLock lock(mutex_);
  return done_ >= ticket;
}

bool CommitScheduler::wants_worker() const {
  const MutexLock lock(mutex_);
  return done_ < asked_ || (!closed_ && under_way_ && written_ == begun_);
}

void CommitScheduler::run() {
  bool asked = false, through = false;
  {
    const MutexLock lock(mutex_);
    asked = done_ < asked_;
    through = under_way_ && written_ == begun_;
  }
  if (through) finish();
  if (asked)
    commit();
  else
    begin_if_due();
}

void CommitScheduler::begin_if_due() {
  const bool full = !failing_ && map_->commit_is_due();
  if (full || (Clock::now() >= next_due() && !is_writing())) begin();
}

bool CommitScheduler::is_writing() const {
  const MutexLock lock(mutex_);
  return under_way_ && written_ != begun_;
}

void CommitScheduler::commit() {
  std::uint64_t asked = 0;
  {
    const MutexLock lock(mutex_);
    asked = asked_;
  }
  finish();
  begin();
  finish();
  {
    const MutexLock lock(mutex_);
    done_ = asked;
  }
  hooks_.on_change();
}

void CommitScheduler::begin() {
  last_ = Clock::now();
  if (closed_) return;
  finish();
  if (std::set<FrameId> open = hooks_.open_lookups(); map_->state().lookups != open)
    map_->state().lookups = std::move(open);
  std::uint64_t number = 0;
  {
    const MutexLock lock(mutex_);
    number = ++begun_;
    under_way_ = true;
  }
  Status begun;
  busy_.begin();
  try {
    begun = map_->begin_commit([this, number, began = last_] {
      commits_.add(Clock::now() - began);
      busy_.end();
      {
        const MutexLock lock(mutex_);
        written_ = number;
      }
      hooks_.on_change();
    });
  } catch (const std::exception&) {
    begun = caught_status();
  }
  budget_->set(storage::Share::kEngine, engine_->memory_bytes());
  if (begun.ok()) return;
  busy_.end();
  finish();  // the previous commit, unless it was the one that failed
  {
    const MutexLock lock(mutex_);
    under_way_ = false;
  }
  note(begun);
}

void CommitScheduler::finish() {
  if (closed_) return;
  hooks_.on_wait(true);
  const std::optional<Status> outcome = map_->finish_commit();
  hooks_.on_wait(false);
  if (!outcome) return;
  budget_->set(storage::Share::kEngine, engine_->memory_bytes());
  {
    const MutexLock lock(mutex_);
    under_way_ = false;
  }
  note(*outcome);
}

void CommitScheduler::note(const Status& outcome) {
  if (!outcome.ok() && !failing_) spdlog::error("commits fail: {}", outcome.to_string());
  if (outcome.ok() && failing_) spdlog::info("commits go through again");
  failing_ = !outcome.ok();
  if (failing_) ++failures_;
  hooks_.on_outcome(outcome);
}

}  // namespace relmap::map
