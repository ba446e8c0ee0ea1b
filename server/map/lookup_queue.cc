#include "server/map/lookup_queue.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>
#include <utility>

#include "proto/base/mutex.h"

namespace relmap::map {

namespace {

constexpr std::size_t kBytesPerFrame = 128;      // of an open frame, here and in the map's state
constexpr int kViews = 3;                        // attempts in a row, each on a new view
constexpr std::chrono::milliseconds kRetry{20};  // then waits so long for memory

}  // namespace

LookupQueue::LookupQueue(std::shared_ptr<storage::Budget> budget) : budget_(std::move(budget)) {}
LookupQueue::~LookupQueue() { stop(); }

void LookupQueue::start(LookUp look_up, Journal journal, std::function<void()> on_change) {
  thread_ = std::thread([this, look_up = std::move(look_up), journal = std::move(journal),
                         on_change = std::move(on_change)] { run(look_up, journal, on_change); });
}

void LookupQueue::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void LookupQueue::push(FrameId frame) {
  const MutexLock lock(mutex_);
  open_locked(frame);
  queue_.push_back(frame);
  changed_.notify_all();
}

void LookupQueue::open(FrameId frame) {
  const MutexLock lock(mutex_);
  open_locked(frame);
}

void LookupQueue::open_locked(FrameId frame) {
  if (open_.insert(frame).second) budget_->charge(storage::Share::kQueues, kBytesPerFrame);
}

void LookupQueue::close(FrameId frame) {
  const MutexLock lock(mutex_);
  close_locked(frame);
}

void LookupQueue::close_locked(FrameId frame) {
  failed_.erase(frame);
  if (open_.erase(frame) > 0) budget_->release(storage::Share::kQueues, kBytesPerFrame);
}

std::set<FrameId> LookupQueue::close_all() {
  const MutexLock lock(mutex_);
  budget_->release(storage::Share::kQueues, open_.size() * kBytesPerFrame);
  failed_.clear();
  return std::exchange(open_, {});
}

void LookupQueue::forget_failed(SessionNumber session) {
  const MutexLock lock(mutex_);
  for (const FrameId frame : std::set<FrameId>(failed_))
    if (frame.session == session) close_locked(frame);
}

std::set<FrameId> LookupQueue::open_frames() const {
  const MutexLock lock(mutex_);
  return open_;
}

bool LookupQueue::is_open(FrameId frame) const {
  const MutexLock lock(mutex_);
  return open_.contains(frame);
}

std::size_t LookupQueue::waiting() const {
  const MutexLock lock(mutex_);
  return open_.size() - failed_.size();
}

bool LookupQueue::is_waiting(SessionNumber session) const {
  const MutexLock lock(mutex_);
  for (auto frame = open_.lower_bound({session, 0}); frame != open_.end() && frame->session == session; ++frame)
    if (!failed_.contains(*frame)) return true;
  return false;
}

bool LookupQueue::is_full() const {
  return waiting() * kBytesPerFrame > budget_->allowance(storage::Share::kQueues) / 2;
}

void LookupQueue::run(const LookUp& look_up, const Journal& journal, const std::function<void()>& on_change) {
  MutexLock lock(mutex_);
  for (;;) {
    changed_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) { return stopping_ || !queue_.empty(); });
    if (stopping_) return;
    const FrameId frame = queue_.front();
    queue_.pop_front();
    lock.unlock();
    const End end = look_up_and_journal(frame, look_up, journal);
    lock.lock();
    if (end == End::kDone) close_locked(frame);
    if (end == End::kFailed) failed_.insert(frame);
    if (end == End::kAgain) {
      queue_.push_back(frame);
      changed_.wait_for(mutex_, kRetry, [this]() RELMAP_REQUIRES(mutex_) { return stopping_; });
    }
    lock.unlock();
    on_change();
    lock.lock();
  }
}

LookupQueue::End LookupQueue::look_up_and_journal(FrameId frame, const LookUp& look_up, const Journal& journal) {
  for (int attempt = 0; attempt < kViews; ++attempt) {
    try {
      for (const storage::JournalRecord& record : look_up(frame))
        if (!journal(record)) return End::kStopped;
      return End::kDone;
    } catch (const std::exception& error) {
      const auto* status = dynamic_cast<const StatusError*>(&error);
      if (status && status->status().reason() == Reason::VIEW_EXPIRED) continue;
      spdlog::error("frame {} is not looked up before the next start: {}", frame.to_string(), error.what());
      return End::kFailed;
    }
  }
  spdlog::warn("the lookup of frame {} waits: its view was cut off {} times", frame.to_string(), kViews);
  return End::kAgain;
}

}  // namespace relmap::map
