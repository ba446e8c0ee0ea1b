#include "server/intake/ingest_server.h"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace relmap {

namespace {
SteadyTime now() { return std::chrono::steady_clock::now(); }
}  // namespace

// Locks are taken in the order subscribers_mutex, mutex, and wake_mutex last.
struct IngestServer::Impl {
  Impl(KeyframeSink& sink, Budget& budget, const BootId& boot_id, IntakeOptions options)
      : boot(boot_id), intake(sink, budget, boot_id, options, [this] { wake(); }) {}

  void wake() {
    const std::lock_guard lock(wake_mutex);
    woken = true;
    wake_condition.notify_one();
  }

  void run() {
    for (bool last = false; !last;) {
      SteadyTime next;
      {
        const std::lock_guard lock(mutex);
        next = planned = intake.next_due(now());
      }
      {
        std::unique_lock lock(wake_mutex);
        wake_condition.wait_until(lock, next, [this] { return woken || stopping; });
        woken = false;
        last = stopping;
      }
      say();
    }
  }

  void say() {
    const std::lock_guard subscribers_lock(subscribers_mutex);
    std::vector<Acknowledgement> due;
    {
      const std::lock_guard lock(mutex);
      due = intake.poll(now());
    }
    for (const Acknowledgement& ack : due)
      for (const auto& [id, callback] : subscribers) callback(ack);
  }

  template <typename Take>
  void take(Take&& action) {
    bool sooner = false;
    {
      const std::lock_guard lock(mutex);
      if (stopped) return;
      action(intake);
      const SteadyTime next = intake.next_due(now());
      sooner = next < planned;
      planned = std::min(planned, next);
    }
    if (sooner) wake();
  }

  const BootId boot;

  // Outlive the intake, which the sink's threads wake until it is gone.
  std::mutex wake_mutex;
  std::condition_variable wake_condition;
  bool woken = false;
  bool stopping = false;

  std::mutex subscribers_mutex;
  std::map<std::uint64_t, std::function<void(const Acknowledgement&)>> subscribers;
  std::uint64_t next_subscriber = 1;

  mutable std::mutex mutex;
  Intake intake;
  bool stopped = false;
  SteadyTime planned = SteadyTime::min();  // when the thread looks again by itself

  std::thread thread;
};

class IngestServer::Entry : public IngestServer::Subscription {
 public:
  Entry(std::shared_ptr<Impl> impl, std::uint64_t id) : impl_(std::move(impl)), id_(id) {}
  ~Entry() override {
    const std::lock_guard lock(impl_->subscribers_mutex);
    impl_->subscribers.erase(id_);
  }

 private:
  const std::shared_ptr<Impl> impl_;
  const std::uint64_t id_;
};

IngestServer::IngestServer(KeyframeSink& sink, Budget& budget, const BootId& boot, IntakeOptions options)
    : impl_(std::make_shared<Impl>(sink, budget, boot, options)) {
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

IngestServer::~IngestServer() { stop(); }

void IngestServer::take_part(const KeyframePart& part) {
  impl_->take([&](Intake& intake) { intake.take_part(part, now()); });
}

void IngestServer::take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload) {
  impl_->take([&](Intake& intake) { intake.take_payload(session, sequence, crc, std::move(payload), now()); });
}

void IngestServer::take_gap(const Gap& gap) {
  impl_->take([&](Intake& intake) { intake.take_gap(gap, now()); });
}

void IngestServer::count_foreign(Reason reason) {
  const std::lock_guard lock(impl_->mutex);
  impl_->intake.count_foreign(reason);
}

Result<Acknowledgement> IngestServer::acknowledgement(const SessionUuid& session) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->intake.acknowledgement(session);
}

IngestStats IngestServer::stats() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->intake.stats();
}

const BootId& IngestServer::boot() const { return impl_->boot; }

std::unique_ptr<IngestServer::Subscription> IngestServer::subscribe(
    std::function<void(const Acknowledgement&)> callback) {
  const std::lock_guard lock(impl_->subscribers_mutex);
  const std::uint64_t id = impl_->next_subscriber++;
  impl_->subscribers.emplace(id, std::move(callback));
  return std::make_unique<Entry>(impl_, id);
}

void IngestServer::stop() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopped = true;
  }
  {
    const std::lock_guard lock(impl_->wake_mutex);
    impl_->stopping = true;
    impl_->wake_condition.notify_one();
  }
  if (impl_->thread.joinable()) impl_->thread.join();
}

}  // namespace relmap
