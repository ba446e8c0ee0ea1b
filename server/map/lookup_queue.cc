#include "server/map/lookup_queue.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <iterator>
#include <limits>
#include <utility>

#include "proto/base/mutex.h"

namespace relmap::map {

namespace {

constexpr std::size_t kBytesPerFrame = 256;      // of an open frame, here and in the map's state
constexpr std::size_t kBytesPushed = 32;         // of a frame in pushed_, which may be closed already
constexpr int kViews = 3;                        // attempts in a row, each on a new view
constexpr std::chrono::milliseconds kRetry{20};  // then waits so long for memory, or for the disk
// The weight of the latest lookup in the mean: some twenty count. A robot that comes to where it was is looked up
// several times as long, and that must show before a hundred frames have come.
constexpr double kOfTheLatest = 0.05;

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

LookupQueue::LookupQueue(std::shared_ptr<storage::Budget> budget, std::chrono::milliseconds max_lag)
    : budget_(std::move(budget)), max_lag_(max_lag) {}
LookupQueue::~LookupQueue() { stop(); }

void LookupQueue::start(std::size_t threads, LookUp look_up, Journal journal, std::function<void()> on_change) {
  look_up_ = std::move(look_up);
  journal_ = std::move(journal);
  on_change_ = std::move(on_change);
  for (std::size_t i = 0; i < threads; ++i) try {
      threads_.emplace_back([this] { run(); });
      const MutexLock lock(mutex_);
      ++running_;
    } catch (const std::exception& error) {  // no more threads, or no memory
      if (threads_.empty()) throw;
      spdlog::warn("{} of {} threads recognise places: {}", i, threads, error.what());
      return;
    }
}

void LookupQueue::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void LookupQueue::push(FrameId frame) {
  const MutexLock lock(mutex_);
  open_locked(frame);
  queue_.push_back({frame, ++last_ticket_});
  tickets_.emplace(last_ticket_, std::chrono::steady_clock::now());
  pushed_[frame.session].push_back(queue_.back());
  budget_->charge(storage::Share::kQueues, kBytesPushed);
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

std::size_t LookupQueue::queued() const {
  const MutexLock lock(mutex_);
  return queue_.size();
}

bool LookupQueue::is_waiting(SessionNumber session) const {
  const MutexLock lock(mutex_);
  for (auto frame = open_.lower_bound({session, 0}); frame != open_.end() && frame->session == session; ++frame)
    if (!failed_.contains(*frame)) return true;
  return false;
}

double LookupQueue::lag_s() const {
  const MutexLock lock(mutex_);
  return tickets_.empty() ? 0 : seconds_since(tickets_.begin()->second);
}

bool LookupQueue::is_full(std::size_t queued) const {
  return waiting() + queued >= kMaxWaiting || expected_lag_s(queued) > std::chrono::duration<double>(max_lag_).count();
}

double LookupQueue::expected_lag_s(std::size_t queued) const {
  const MutexLock lock(mutex_);
  const double next_has_waited = queue_.empty() ? 0 : seconds_since(tickets_.at(queue_.front().ticket));
  const double all_take = static_cast<double>(queue_.size() + queued) * lookup_s_;
  return std::max(next_has_waited, all_take / static_cast<double>(std::max<std::size_t>(1, running_)));
}

std::vector<storage::FrameRange> LookupQueue::later_than(const Pushed& pushed) const {
  const MutexLock lock(mutex_);
  std::vector<storage::FrameRange> later;
  for (const auto& [session, frames] : pushed_) {
    if (session == pushed.frame.session) continue;
    const auto first = std::partition_point(frames.begin(), frames.end(),
                                            [&](const Pushed& other) { return other.ticket < pushed.ticket; });
    if (first != frames.end())
      later.push_back({session, first->frame.index, std::numeric_limits<std::uint32_t>::max()});
  }
  return later;
}

void LookupQueue::forget_pushed(std::uint64_t ticket) {
  tickets_.erase(ticket);
  const std::uint64_t oldest = tickets_.empty() ? last_ticket_ + 1 : tickets_.begin()->first;
  for (auto of_session = pushed_.begin(); of_session != pushed_.end();) {
    std::deque<Pushed>& frames = of_session->second;
    for (; !frames.empty() && frames.front().ticket < oldest; frames.pop_front())
      budget_->release(storage::Share::kQueues, kBytesPushed);
    of_session = frames.empty() ? pushed_.erase(of_session) : std::next(of_session);
  }
}

void LookupQueue::run() {
  MutexLock lock(mutex_);
  for (;;) {
    changed_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) { return stopping_ || !queue_.empty(); });
    changed_.wait_until(mutex_, not_before_, [this]() RELMAP_REQUIRES(mutex_) { return stopping_; });
    if (stopping_) return;
    if (queue_.empty()) continue;
    const Pushed pushed = queue_.front();
    queue_.pop_front();
    lock.unlock();
    const End how = look_up_and_journal(pushed);
    end(pushed, how);
    lock.lock();
    if (how == End::kAgain) changed_.wait_for(mutex_, kRetry, [this]() RELMAP_REQUIRES(mutex_) { return stopping_; });
  }
}

void LookupQueue::end(const Pushed& pushed, End how) {
  if (how == End::kJournalled) return;
  {
    const MutexLock lock(mutex_);
    if (how == End::kAgain || how == End::kRefused) {
      if (how == End::kRefused) not_before_ = std::chrono::steady_clock::now() + kRetry;
      queue_.push_back(pushed);
      changed_.notify_all();
    } else {
      forget_pushed(pushed.ticket);
    }
    if (how == End::kDone) close_locked(pushed.frame);
    if (how == End::kFailed) failed_.insert(pushed.frame);
  }
  on_change_();
}

LookupQueue::End LookupQueue::look_up_and_journal(const Pushed& pushed) {
  const LaterFrames later = [&] { return later_than(pushed); };
  for (int attempt = 0; attempt < kViews; ++attempt) {
    try {
      const auto begin = std::chrono::steady_clock::now();
      const std::vector<storage::JournalRecord> found = look_up_(pushed.frame, later);
      const double took_s = seconds_since(begin);
      lookups_.add(took_s);
      {
        const MutexLock lock(mutex_);
        lookup_s_ += kOfTheLatest * (took_s - lookup_s_);
      }
      return journal(pushed, found);
    } catch (const std::exception& error) {
      const auto* status = dynamic_cast<const StatusError*>(&error);
      if (status && status->status().reason() == Reason::VIEW_EXPIRED) continue;
      spdlog::error("frame {} is not looked up before the next start: {}", pushed.frame.to_string(), error.what());
      return End::kFailed;
    }
  }
  spdlog::warn("the lookup of frame {} waits: its view was cut off {} times", pushed.frame.to_string(), kViews);
  return End::kAgain;
}

LookupQueue::End LookupQueue::journal(const Pushed& pushed, const std::vector<storage::JournalRecord>& found) {
  if (found.empty()) return End::kDone;
  struct Outcome {
    explicit Outcome(std::size_t records) : left(records) {}
    std::atomic<std::size_t> left;
    std::atomic<bool> durable = true;
  };
  const auto outcome = std::make_shared<Outcome>(found.size());
  const Durable done = [this, pushed, outcome](bool durable) {
    if (!durable) outcome->durable = false;
    if (--outcome->left == 0) end(pushed, outcome->durable ? End::kDone : End::kRefused);
  };
  for (const storage::JournalRecord& record : found)
    if (!journal_(record, done)) return End::kStopped;  // its share of `left` stays, so the frame stays open
  return End::kJournalled;
}

}  // namespace relmap::map
