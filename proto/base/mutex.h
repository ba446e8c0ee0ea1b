// A mutex whose use clang checks at compile time. A field names the mutex that guards it (RELMAP_GUARDED_BY), and a
// function the mutex that its caller must hold (RELMAP_REQUIRES). Builds by clang (tools/lint --threads, tools/fuzz)
// fail where code uses such a field, or calls such a function, without the mutex. Other compilers ignore the
// annotations. See https://clang.llvm.org/docs/ThreadSafetyAnalysis.html.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <shared_mutex>

#if defined(__clang__)
#define RELMAP_THREAD_ANNOTATION(x) __attribute__((x))
#else
#define RELMAP_THREAD_ANNOTATION(x)
#endif

// Marks a field that may be read and written only while the mutex is held.
#define RELMAP_GUARDED_BY(mutex) RELMAP_THREAD_ANNOTATION(guarded_by(mutex))
// Marks a function or a lambda whose caller holds the mutex.
#define RELMAP_REQUIRES(...) RELMAP_THREAD_ANNOTATION(requires_capability(__VA_ARGS__))
// Marks a function in which uses of guarded fields are not checked. Its comment says why it may use them.
#define RELMAP_NO_THREAD_SAFETY_ANALYSIS RELMAP_THREAD_ANNOTATION(no_thread_safety_analysis)

namespace relmap {

class RELMAP_THREAD_ANNOTATION(capability("mutex")) Mutex {
 public:
  Mutex() = default;
  Mutex(const Mutex&) = delete;
  Mutex& operator=(const Mutex&) = delete;

  void lock() RELMAP_THREAD_ANNOTATION(acquire_capability()) { mutex_.lock(); }
  void unlock() RELMAP_THREAD_ANNOTATION(release_capability()) { mutex_.unlock(); }
  bool try_lock() RELMAP_THREAD_ANNOTATION(try_acquire_capability(true)) { return mutex_.try_lock(); }

 private:
  friend class MutexLock;
  friend class ConditionVariable;
  std::mutex mutex_;
};

// Holds a mutex for as long as it lives, except between unlock() and lock().
class RELMAP_THREAD_ANNOTATION(scoped_lockable) MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) RELMAP_THREAD_ANNOTATION(acquire_capability(mutex)) : lock_(mutex.mutex_) {}
  // Of a mutex that try_lock() has locked.
  MutexLock(Mutex& mutex, std::adopt_lock_t adopt) RELMAP_REQUIRES(mutex) : lock_(mutex.mutex_, adopt) {}
  ~MutexLock() RELMAP_THREAD_ANNOTATION(release_capability()) {}
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

  void unlock() RELMAP_THREAD_ANNOTATION(release_capability()) { lock_.unlock(); }
  void lock() RELMAP_THREAD_ANNOTATION(acquire_capability()) { lock_.lock(); }

 private:
  std::unique_lock<std::mutex> lock_;
};

// Releases a mutex for as long as it lives, in a function that requires the mutex.
class RELMAP_THREAD_ANNOTATION(scoped_lockable) MutexUnlock {
 public:
  explicit MutexUnlock(Mutex& mutex) RELMAP_THREAD_ANNOTATION(release_capability(mutex)) : mutex_(mutex) {
    mutex_.unlock();
  }
  ~MutexUnlock() RELMAP_THREAD_ANNOTATION(release_capability()) { mutex_.lock(); }
  MutexUnlock(const MutexUnlock&) = delete;
  MutexUnlock& operator=(const MutexUnlock&) = delete;

 private:
  Mutex& mutex_;
};

// A mutex that any number may hold together to read what it guards, or one alone to change it.
class RELMAP_THREAD_ANNOTATION(capability("mutex")) SharedMutex {
 public:
  SharedMutex() = default;
  SharedMutex(const SharedMutex&) = delete;
  SharedMutex& operator=(const SharedMutex&) = delete;

 private:
  friend class ExclusiveLock;
  friend class SharedLock;
  std::shared_mutex mutex_;
};

// Holds a shared mutex alone for as long as it lives.
class RELMAP_THREAD_ANNOTATION(scoped_lockable) ExclusiveLock {
 public:
  explicit ExclusiveLock(SharedMutex& mutex) RELMAP_THREAD_ANNOTATION(acquire_capability(mutex))
      : lock_(mutex.mutex_) {}
  ~ExclusiveLock() RELMAP_THREAD_ANNOTATION(release_capability()) {}
  ExclusiveLock(const ExclusiveLock&) = delete;
  ExclusiveLock& operator=(const ExclusiveLock&) = delete;

 private:
  std::unique_lock<std::shared_mutex> lock_;
};

// Holds a shared mutex, perhaps together with others, for as long as it lives.
class RELMAP_THREAD_ANNOTATION(scoped_lockable) SharedLock {
 public:
  explicit SharedLock(SharedMutex& mutex) RELMAP_THREAD_ANNOTATION(acquire_shared_capability(mutex))
      : lock_(mutex.mutex_) {}
  ~SharedLock() RELMAP_THREAD_ANNOTATION(release_capability()) {}
  SharedLock(const SharedLock&) = delete;
  SharedLock& operator=(const SharedLock&) = delete;

 private:
  std::shared_lock<std::shared_mutex> lock_;
};

// std::condition_variable for a Mutex. The caller holds the mutex. A predicate is annotated with it, too:
// `changed_.wait(mutex_, [this]() RELMAP_REQUIRES(mutex_) { return done_; });`
class ConditionVariable {
 public:
  void notify_one() { variable_.notify_one(); }
  void notify_all() { variable_.notify_all(); }

  template <typename... Predicate>
  void wait(Mutex& mutex, Predicate... predicate) RELMAP_REQUIRES(mutex) {
    const Held held(mutex);
    variable_.wait(held.lock(), predicate...);
  }
  // Return what std::condition_variable does: with a predicate its last value, without one std::cv_status.
  template <typename... Predicate>
  auto wait_for(Mutex& mutex, std::chrono::nanoseconds time, Predicate... predicate) RELMAP_REQUIRES(mutex) {
    const Held held(mutex);
    return variable_.wait_for(held.lock(), time, predicate...);
  }
  template <typename Clock, typename Duration, typename... Predicate>
  auto wait_until(Mutex& mutex, std::chrono::time_point<Clock, Duration> time, Predicate... predicate)
      RELMAP_REQUIRES(mutex) {
    const Held held(mutex);
    return variable_.wait_until(held.lock(), time, predicate...);
  }

 private:
  // Lends the mutex of the caller to std::condition_variable; it stays held.
  class Held {
   public:
    explicit Held(Mutex& mutex) : lock_(mutex.mutex_, std::adopt_lock) {}
    ~Held() { lock_.release(); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    std::unique_lock<std::mutex>& lock() const { return lock_; }

   private:
    mutable std::unique_lock<std::mutex> lock_;
  };

  std::condition_variable variable_;
};

}  // namespace relmap
