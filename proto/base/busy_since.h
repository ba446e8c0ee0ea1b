// For how long a thread has been at its present piece of work, so that others can tell that it hangs.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace relmap {

// One thread works, any thread asks; nobody waits.
class BusySince {
 public:
  // A piece of work begins, whether or not the previous one was ended.
  void begin() { since_ns_.store(now_ns(), std::memory_order_relaxed); }
  void end() { since_ns_.store(kIdle, std::memory_order_relaxed); }

  // Seconds since the present piece of work began; 0 between two of them.
  double seconds() const {
    const std::int64_t since = since_ns_.load(std::memory_order_relaxed);
    return since == kIdle ? 0 : static_cast<double>(now_ns() - since) / 1e9;
  }

  // A piece of work as long as this object lives.
  class Work {
   public:
    explicit Work(BusySince& busy) : busy_(busy) { busy_.begin(); }
    ~Work() { busy_.end(); }
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;

   private:
    BusySince& busy_;
  };

 private:
  static constexpr std::int64_t kIdle = 0;
  static std::int64_t now_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  std::atomic<std::int64_t> since_ns_ = kIdle;
};

}  // namespace relmap
