#include "server/map/record_queue.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <utility>
#include <variant>

namespace relmap::map {

RecordQueue::RecordQueue(storage::WordFunction words, std::shared_ptr<storage::Budget> budget, std::size_t threads)
    : words_(std::move(words)), budget_(std::move(budget)), max_ahead_(4 * threads) {
  for (std::size_t i = 0; i < threads; ++i) try {
      threads_.emplace_back([this] { run(); });
    } catch (const std::exception& error) {  // no more threads, or no memory: the worker prepares what no thread does
      spdlog::warn("{} of {} threads prepare keyframes: {}", i, threads, error.what());
      return;
    }
}

RecordQueue::~RecordQueue() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
}

void RecordQueue::push(std::vector<DurableRecord> group) {
  const MutexLock lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  for (DurableRecord& record : group) {
    const bool is_keyframe = std::holds_alternative<storage::KeyframeRecord>(record.record);
    entries_.push_back({{std::move(record), {}}, is_keyframe ? Stage::kWaits : Stage::kReady, now});
  }
  changed_.notify_all();
}

std::size_t RecordQueue::size() const {
  const MutexLock lock(mutex_);
  return entries_.size();
}

double RecordQueue::lag_s() const {
  const MutexLock lock(mutex_);
  if (entries_.empty()) return 0;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - entries_.front().pushed).count();
}

RecordQueue::Next RecordQueue::take() {
  MutexLock lock(mutex_);
  Entry& first = entries_.front();
  changed_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) { return first.stage != Stage::kInWork; });
  Next next = std::move(first.next);
  if (next.prepared) budget_->release(storage::Share::kQueues, next.durable.bytes);
  entries_.pop_front();
  changed_.notify_all();
  return next;
}

RecordQueue::Entry* RecordQueue::first_waiting() {
  const auto end = std::next(entries_.begin(), static_cast<std::ptrdiff_t>(std::min(max_ahead_, entries_.size())));
  const auto found =
      std::find_if(entries_.begin(), end, [](const Entry& entry) { return entry.stage == Stage::kWaits; });
  return found == end ? nullptr : &*found;
}

// If it throws, the worker will prepare the keyframe, and report the exception if it comes again.
void RecordQueue::prepare_entry(Entry& entry) {
  entry.stage = Stage::kInWork;
  const auto& record = std::get<storage::KeyframeRecord>(entry.next.durable.record);
  std::optional<PreparedKeyframe> prepared;
  {
    const MutexUnlock unlock(mutex_);
    try {
      prepared = prepare(record, words_);
    } catch (const std::exception& error) {
      spdlog::error("a keyframe could not be prepared beside the worker: {}", error.what());
    }
  }
  if (prepared) budget_->charge(storage::Share::kQueues, entry.next.durable.bytes);
  entry.next.prepared = std::move(prepared);
  entry.stage = Stage::kReady;
  changed_.notify_all();
}

void RecordQueue::run() {
  MutexLock lock(mutex_);
  for (;;) {
    Entry* entry = nullptr;
    changed_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) { return stopping_ || (entry = first_waiting()) != nullptr; });
    if (stopping_) return;
    prepare_entry(*entry);
  }
}

}  // namespace relmap::map
