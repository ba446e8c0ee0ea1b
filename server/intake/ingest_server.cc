#include "server/intake/ingest_server.h"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "proto/base/clock.h"
#include "server/intake/part_queue.h"

namespace relmap::intake {

namespace {
SteadyTime now() { return std::chrono::steady_clock::now(); }
}  // namespace

constexpr int kPartsAtOnce = 64;  // taken in under one lock
constexpr std::size_t kMaxNews = 4096;

// Locks are taken in the order subscribers_mutex, mutex, and wake_mutex or queue_mutex last.
struct IngestServer::Impl {
  Impl(KeyframeSink& sink, storage::Budget& b, const BootId& boot_id, IngestServerOptions options)
      : identity{boot_id, options.map},
        budget(b),
        queue_bytes(options.part_queue_bytes),
        queue(options.part_queue_bytes),
        intake(sink, b, boot_id, std::move(options), [this] { wake(); }) {
    budget.charge(storage::Share::kReassembly, queue_bytes);
  }
  ~Impl() { budget.release(storage::Share::kReassembly, queue_bytes); }

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
    const std::lock_guard lock(subscribers_mutex);
    all_said = true;
    for (const auto& [id, listener] : subscribers)
      if (listener.stopping) listener.stopping();
  }

  void say() {
    const std::lock_guard subscribers_lock(subscribers_mutex);
    std::vector<Acknowledgement> due;
    std::vector<PoseNews> news;
    std::vector<RobotEvent> events;
    {
      const std::lock_guard lock(mutex);
      due = intake.poll(now());
      news = intake.take_news();
      events = intake.take_events();
    }
    {
      const std::lock_guard lock(wake_mutex);
      news.insert(news.end(), told.begin(), told.end());
      told.clear();
    }
    for (PoseNews& item : news) {
      item.boot = identity.boot;
      item.time_us = now_us();
    }
    for (const auto& [id, listener] : subscribers) {
      if (listener.acknowledged)
        for (const Acknowledgement& ack : due) listener.acknowledged(ack);
      if (listener.news)
        for (const PoseNews& item : news) listener.news(item);
      if (listener.robot)
        for (const RobotEvent& event : events) listener.robot(event);
    }
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

  void enqueue(KeyframePart part) {
    if (const Status sound = check_part(part); !sound.ok()) {
      const std::lock_guard lock(queue_mutex);
      ++unsound[index_of(sound.reason())];
      return;
    }
    const std::lock_guard lock(queue_mutex);
    const bool answers = begun.contains(part.session);
    queue.push(answers ? part.session : SessionUuid{}, std::move(part));
    queue_condition.notify_one();
  }

  void serve_parts() {
    std::vector<KeyframePart> parts;
    for (;;) {
      parts.clear();
      {
        std::unique_lock lock(queue_mutex);
        queue_condition.wait(lock, [this] { return queue_stopping || !queue.empty(); });
        while (parts.size() < kPartsAtOnce) {
          auto part = queue.pop();
          if (!part) break;
          parts.push_back(std::move(*part));
        }
      }
      if (parts.empty()) return;
      std::optional<std::set<SessionUuid>> changed;
      take([&](Intake& i) {
        for (const KeyframePart& part : parts) i.take_part(part, now());
        if (std::exchange(begun_version, i.begun_version()) != i.begun_version()) changed = i.begun();
      });
      if (!changed) continue;
      const std::lock_guard lock(queue_mutex);
      begun = std::move(*changed);
      queue.keep_only(begun);
    }
  }

  const DaemonIdentity identity;
  storage::Budget& budget;
  const std::size_t queue_bytes;

  // Outlive the intake, which the sink's threads wake until it is gone.
  std::mutex wake_mutex;
  std::condition_variable wake_condition;
  bool woken = false;
  bool stopping = false;
  std::vector<PoseNews> told;  // guarded by wake_mutex

  std::mutex subscribers_mutex;
  std::map<std::uint64_t, Listener> subscribers;
  std::uint64_t next_subscriber = 1;
  bool all_said = false;  // guarded by subscribers_mutex: new subscribers are told `stopping` at once

  mutable std::mutex queue_mutex;
  std::condition_variable queue_condition;
  PartQueue queue;
  std::set<SessionUuid> begun;  // each has a queue of its own
  ReasonCounts unsound{};       // parts that check_part() refused
  bool queue_stopping = false;

  mutable std::mutex mutex;
  Intake intake;
  std::uint64_t begun_version = 0;
  bool stopped = false;
  SteadyTime planned = SteadyTime::min();  // when the thread polls next without being woken

  std::thread thread, parts_thread;
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

IngestServer::IngestServer(KeyframeSink& sink, storage::Budget& budget, const BootId& boot, IngestServerOptions options)
    : impl_(std::make_shared<Impl>(sink, budget, boot, std::move(options))) {
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
  impl_->parts_thread = std::thread([impl = impl_.get()] { impl->serve_parts(); });
}

IngestServer::~IngestServer() { stop(); }

void IngestServer::take_part(KeyframePart part) { impl_->enqueue(std::move(part)); }

void IngestServer::take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload) {
  impl_->take([&](Intake& intake) { intake.take_payload(session, sequence, crc, std::move(payload), now()); });
}

void IngestServer::take_gap(Gap gap) {
  impl_->take([&](Intake& intake) { intake.take_gap(gap, now()); });
}

void IngestServer::take_end(SessionEnd end) {
  impl_->take([&](Intake& intake) { intake.take_end(end, now()); });
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
  IngestStats stats;
  {
    const std::lock_guard lock(impl_->mutex);
    stats = impl_->intake.stats();
  }
  const std::lock_guard lock(impl_->queue_mutex);
  for (std::size_t i = 0; i < impl_->unsound.size(); ++i) {
    stats.parts += impl_->unsound[i];
    stats.parts_refused[i] += impl_->unsound[i];
  }
  return stats;
}

std::vector<RobotStats> IngestServer::robots() const {
  std::vector<RobotStats> robots;
  {
    const std::lock_guard lock(impl_->mutex);
    robots = impl_->intake.robots(now());
  }
  const std::lock_guard lock(impl_->queue_mutex);
  for (RobotStats& robot : robots) {
    const PartQueue::Facts facts = impl_->queue.of(robot.uuid);
    robot.queued = facts.waiting;
    robot.dropped = facts.dropped;
  }
  return robots;
}

const DaemonIdentity& IngestServer::identity() const { return impl_->identity; }

void IngestServer::tell(PoseNews news) {
  {
    const std::lock_guard lock(impl_->wake_mutex);
    if (impl_->told.size() >= kMaxNews) return;  // news are not reliable: transports may lose them too
    impl_->told.push_back(std::move(news));
  }
  impl_->wake();
}

std::unique_ptr<IngestServer::Subscription> IngestServer::subscribe(Listener listener) {
  const std::lock_guard lock(impl_->subscribers_mutex);
  const std::uint64_t id = impl_->next_subscriber++;
  if (impl_->all_said && listener.stopping) listener.stopping();
  impl_->subscribers.emplace(id, std::move(listener));
  return std::make_unique<Entry>(impl_, id);
}

void IngestServer::stop() {
  {
    const std::lock_guard lock(impl_->queue_mutex);
    impl_->queue_stopping = true;
    impl_->queue_condition.notify_one();
  }
  if (impl_->parts_thread.joinable()) impl_->parts_thread.join();
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

}  // namespace relmap::intake
