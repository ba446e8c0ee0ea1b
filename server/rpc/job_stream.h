// A job of minutes or hours as a stream of messages: the job runs on a thread of its own, and the stream takes its
// messages.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <thread>

#include "proto/base/mutex.h"
#include "server/rpc/deadline.h"
#include "server/rpc/maintenance_turn.h"

namespace relmap::rpc {

// Thread-safe.
template <typename Reply>
class JobStream {
 public:
  // Starts `job`, which is done when it returns. `deadline` must outlive the stream.
  JobStream(MaintenanceTurn::Held turn, const Deadline& deadline, std::function<Status(JobStream&)> job)
      : turn_(std::move(turn)), deadline_(deadline), thread_([this, job = std::move(job)] { run(job); }) {}
  // Tells the job to end, and waits for it.
  ~JobStream() {
    {
      const MutexLock lock(mutex_);
      abandoned_ = true;
      changed_.notify_all();
    }
    thread_.join();
  }
  JobStream(const JobStream&) = delete;
  JobStream& operator=(const JobStream&) = delete;

  // Called by the job. Not ok if nobody waits for it any more.
  Status check() const {
    const MutexLock lock(mutex_);
    if (abandoned_) return {Reason::DEADLINE, "the caller has gone"};
    return deadline_.check();
  }
  // Called by the job. Sets its progress, of which only the newest is sent.
  void show(Reply progress) {
    const MutexLock lock(mutex_);
    progress_ = std::move(progress);
  }
  // Called by the job. Sends a message; waits while kUnsent messages have not been taken.
  void send(Reply reply) {
    MutexLock lock(mutex_);
    changed_.wait(mutex_, [this]() RELMAP_REQUIRES(mutex_) { return unsent_.size() < kUnsent || abandoned_; });
    if (!abandoned_) unsent_.push_back(std::move(reply));
    changed_.notify_all();
  }

  // Called by the stream. Returns the next message, or every kPulse the progress, by which the caller sees that the
  // work goes on, and the daemon whether the caller has gone. nullopt at the end, or the status with which the job
  // failed.
  Result<std::optional<Reply>> take() {
    MutexLock lock(mutex_);
    changed_.wait_for(mutex_, kPulse, [this]() RELMAP_REQUIRES(mutex_) { return !unsent_.empty() || end_; });
    if (unsent_.empty()) {
      if (!end_) return std::optional<Reply>(progress_);
      if (!end_->ok()) return *end_;
      return std::optional<Reply>();
    }
    Reply reply = std::move(unsent_.front());
    unsent_.pop_front();
    changed_.notify_all();
    return std::optional<Reply>(std::move(reply));
  }

 private:
  static constexpr std::chrono::milliseconds kPulse{200};
  static constexpr std::size_t kUnsent = 4;

  void run(const std::function<Status(JobStream&)>& job) {
    Status end;
    try {
      end = job(*this);
    } catch (const std::exception&) {
      end = caught_status();
    }
    const MutexLock lock(mutex_);
    end_ = std::move(end);
    changed_.notify_all();
  }

  const MaintenanceTurn::Held turn_;
  const Deadline& deadline_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  std::deque<Reply> unsent_ RELMAP_GUARDED_BY(mutex_);
  Reply progress_ RELMAP_GUARDED_BY(mutex_);
  std::optional<Status> end_ RELMAP_GUARDED_BY(mutex_);
  bool abandoned_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // declared last, since it uses the others
};

}  // namespace relmap::rpc
