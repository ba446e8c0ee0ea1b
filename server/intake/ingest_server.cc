#include "server/intake/ingest_server.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "proto/base/busy_since.h"
#include "proto/base/clock.h"
#include "proto/base/mutex.h"
#include "server/intake/part_queue.h"

namespace relmap::intake {

namespace {
SteadyTime now() { return std::chrono::steady_clock::now(); }
}  // namespace

constexpr int kPartsAtOnce = 64;  // taken in under one lock
constexpr std::size_t kMaxNews = 4096;
constexpr std::size_t kMaxWaiting = 1024;  // messages for which the map is read first
constexpr char kTooManyWait[] = "too many messages wait until the map was read";
const Status kStopped{Reason::SHUTTING_DOWN, "the daemon takes nothing more in"};

// Locks are taken in the order subscribers_mutex, mutex, and wake_mutex or queue_mutex last.
struct IngestServer::Impl {
  Impl(KeyframeSink& map, storage::Budget& b, const BootId& boot_id, IngestServerOptions options)
      : sink(map),
        identity{boot_id, options.map},
        budget(b),
        queue_bytes(options.part_queue_bytes),
        queue(options.part_queue_bytes),
        intake(map, b, boot_id, std::move(options), [this] { wake(); }) {
    budget.charge(storage::Share::kReassembly, queue_bytes);
  }
  ~Impl() { budget.release(storage::Share::kReassembly, queue_bytes); }

  void wake() {
    const MutexLock lock(wake_mutex);
    woken = true;
    wake_condition.notify_one();
  }

  void run() {
    for (bool last = false; !last;) {
      SteadyTime next;
      busy.begin();
      {
        const MutexLock lock(mutex);
        next = planned = intake.next_due(now());
      }
      busy.end();
      {
        MutexLock lock(wake_mutex);
        wake_condition.wait_until(wake_mutex, next, [this]() RELMAP_REQUIRES(wake_mutex) { return woken || stopping; });
        woken = false;
        last = stopping;
      }
      busy.begin();
      say();
      busy.end();
    }
    const MutexLock lock(subscribers_mutex);
    all_said = true;
    for (const auto& [id, listener] : subscribers)
      if (listener.stopping) listener.stopping();
  }

  void say() {
    const MutexLock subscribers_lock(subscribers_mutex);
    std::vector<Acknowledgement> due;
    std::vector<PoseNews> news;
    std::vector<RobotEvent> events;
    std::vector<std::string> robots_of_due, robots_of_news;
    {
      const MutexLock lock(wake_mutex);
      for (auto& [item, robot] : told) {
        news.push_back(std::move(item));
        robots_of_news.push_back(std::move(robot));
      }
      told.clear();
    }
    {
      const MutexLock lock(mutex);
      due = intake.poll(now());
      for (PoseNews& item : intake.take_news()) {
        robots_of_news.push_back(intake.robot_of(item.session));
        news.push_back(std::move(item));
      }
      events = intake.take_events();
      for (const Acknowledgement& ack : due) robots_of_due.push_back(intake.robot_of(ack.session));
    }
    for (PoseNews& item : news) {
      item.boot = identity.boot;
      item.time_us = now_us();
    }
    for (const auto& [id, listener] : subscribers) {
      if (listener.acknowledged)
        for (std::size_t i = 0; i < due.size(); ++i) listener.acknowledged(due[i], robots_of_due[i]);
      if (listener.news)
        for (std::size_t i = 0; i < news.size(); ++i) listener.news(news[i], robots_of_news[i]);
      if (listener.robot)
        for (const RobotEvent& event : events) listener.robot(event);
    }
  }

  // A message that waits until what the map knows of its session, or of its sequence, has been read.
  struct Waiting {
    SessionUuid session;
    std::optional<std::uint32_t> sequence;
    Sender sender;
    std::function<Status(Intake&)> action;  // returns what the sender is to know
    Taken taken;

    void done(const Status& status) const {
      if (taken) taken(status);
    }
  };

  // Takes the message in, unless something has to be read of the map first: then that.
  std::optional<MapQuestion> try_to_take(const Waiting& message, Status& status, Party* party = nullptr) {
    bool sooner = false;
    {
      const MutexLock lock(mutex);
      if (stopped) {
        status = kStopped;
        return std::nullopt;
      }
      if (auto unread = intake.question(message.session, message.sequence, message.sender)) {
        if (party) *party = intake.party(message.session, message.sender);
        return unread;
      }
      status = message.action(intake);
      sooner = plan();
    }
    if (sooner) wake();
    return std::nullopt;
  }

  void take(Waiting message) {
    Status status;
    Party party;
    std::optional<Waiting> refused;
    if (!try_to_take(message, status, &party)) return message.done(status);
    {
      const MutexLock lock(waiting_mutex);
      const bool full = waiting.size() >= kMaxWaiting;
      if (full) refused = waiting.make_room(party);
      if (waiting_stopping) {
        status = kStopped;
      } else if (full && !refused) {
        status = {Reason::BUDGET_EXCEEDED, kTooManyWait};
      } else {
        waiting.push(party, std::move(message));
        waiting_condition.notify_one();
      }
    }
    if (refused) refused->done({Reason::BUDGET_EXCEEDED, kTooManyWait});
    if (!status.ok()) message.done(status);
  }

  // Whether the thread has to poll sooner than it plans to.
  bool plan() RELMAP_REQUIRES(mutex) {
    const SteadyTime next = intake.next_due(now());
    const bool sooner = next < planned;
    planned = std::min(planned, next);
    return sooner;
  }

  // Reads the map for the messages that wait, and takes them in.
  void read_map() {
    for (;;) {
      Waiting message;
      {
        MutexLock lock(waiting_mutex);
        waiting_condition.wait(
            waiting_mutex, [this]() RELMAP_REQUIRES(waiting_mutex) { return waiting_stopping || !waiting.empty(); });
        if (waiting.empty()) return;
        message = waiting.pop();
      }
      Status status;
      while (const auto unread = try_to_take(message, status)) read(*unread);
      message.done(status);
    }
  }

  void read(const MapQuestion& unread) {
    MapAnswer found = answer(sink, unread);
    const MutexLock lock(mutex);
    intake.know(unread, std::move(found));
  }

  void enqueue(KeyframePart part, Sender sender) {
    if (const Status sound = check_part(part); !sound.ok()) {
      const MutexLock lock(queue_mutex);
      ++unsound[index_of(sound.reason())];
      return;
    }
    const MutexLock lock(queue_mutex);
    const auto owner = begun.find(part.session);
    const Party party = party_of(part.session, sender, owner == begun.end() ? nullptr : &owner->second);
    queue.push(party, {std::move(part), std::move(sender)});
    queue_condition.notify_one();
  }

  void serve_parts() {
    std::vector<PartQueue::Sent> parts;
    for (;;) {
      parts.clear();
      {
        MutexLock lock(queue_mutex);
        queue_condition.wait(queue_mutex,
                             [this]() RELMAP_REQUIRES(queue_mutex) { return queue_stopping || !queue.empty(); });
        while (parts.size() < kPartsAtOnce) {
          auto part = queue.pop();
          if (!part) break;
          parts.push_back(std::move(*part));
        }
      }
      if (parts.empty()) return;
      std::optional<std::map<SessionUuid, Owner>> changed;
      std::vector<PartQueue::Sent> later;
      bool sooner = false;
      {
        const MutexLock lock(mutex);
        for (PartQueue::Sent& sent : parts)
          if (intake.question(sent.part.session, sent.part.sequence, sent.sender))
            later.push_back(std::move(sent));
          else
            intake.take_part(sent.part, now(), sent.sender);
        if (std::exchange(begun_version, intake.begun_version()) != intake.begun_version()) changed = intake.begun();
        sooner = plan();
      }
      if (sooner) wake();
      for (PartQueue::Sent& sent : later) {
        const SessionUuid session = sent.part.session;
        const std::uint32_t sequence = sent.part.sequence;
        take({session,
              sequence,
              sent.sender,
              [sent = std::make_shared<const PartQueue::Sent>(std::move(sent))](Intake& i) {
                i.take_part(sent->part, now(), sent->sender);
                return Status();
              },
              {}});
      }
      if (!changed) continue;
      std::set<std::string> robots;
      for (const auto& [session, owner] : *changed) robots.insert(owner.robot);
      const MutexLock lock(queue_mutex);
      begun.swap(*changed);
      queue.keep_only([&](const Party& party) RELMAP_REQUIRES(queue_mutex) {
        return begun.contains(party.session) || robots.contains(party.robot);
      });
    }
  }

  KeyframeSink& sink;
  const DaemonIdentity identity;
  storage::Budget& budget;
  const std::size_t queue_bytes;
  BusySince busy;  // the thread of run()

  // Outlive the intake, which the sink's threads wake until it is gone.
  Mutex wake_mutex;
  ConditionVariable wake_condition;
  bool woken RELMAP_GUARDED_BY(wake_mutex) = false;
  bool stopping RELMAP_GUARDED_BY(wake_mutex) = false;
  std::vector<std::pair<PoseNews, std::string>> told RELMAP_GUARDED_BY(wake_mutex);

  Mutex subscribers_mutex;
  std::map<std::uint64_t, Listener> subscribers RELMAP_GUARDED_BY(subscribers_mutex);
  std::uint64_t next_subscriber RELMAP_GUARDED_BY(subscribers_mutex) = 1;
  bool all_said RELMAP_GUARDED_BY(subscribers_mutex) = false;  // new subscribers are told `stopping` at once

  mutable Mutex queue_mutex;
  ConditionVariable queue_condition;
  PartQueue queue RELMAP_GUARDED_BY(queue_mutex);
  std::map<SessionUuid, Owner> begun RELMAP_GUARDED_BY(queue_mutex);  // each has a queue of its own
  ReasonCounts unsound RELMAP_GUARDED_BY(queue_mutex){};              // parts that check_part() refused
  bool queue_stopping RELMAP_GUARDED_BY(queue_mutex) = false;

  Mutex waiting_mutex;
  ConditionVariable waiting_condition;
  TurnQueue<Waiting, Party> waiting RELMAP_GUARDED_BY(waiting_mutex);
  bool waiting_stopping RELMAP_GUARDED_BY(waiting_mutex) = false;

  mutable Mutex mutex;
  Intake intake RELMAP_GUARDED_BY(mutex);
  std::uint64_t begun_version RELMAP_GUARDED_BY(mutex) = 0;
  bool stopped RELMAP_GUARDED_BY(mutex) = false;
  SteadyTime planned RELMAP_GUARDED_BY(mutex) = SteadyTime::min();  // when the thread polls next without being woken

  std::thread thread, parts_thread, map_thread;
};

class IngestServer::Entry : public IngestServer::Subscription {
 public:
  Entry(std::shared_ptr<Impl> impl, std::uint64_t id) : impl_(std::move(impl)), id_(id) {}
  ~Entry() override {
    const MutexLock lock(impl_->subscribers_mutex);
    impl_->subscribers.erase(id_);
  }

 private:
  const std::shared_ptr<Impl> impl_;
  const std::uint64_t id_;
};

IngestServer::IngestServer(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

// Delegates so that the destructor ends the threads that run already if one cannot be started.
IngestServer::IngestServer(KeyframeSink& sink, storage::Budget& budget, const BootId& boot, IngestServerOptions options)
    : IngestServer(std::make_shared<Impl>(sink, budget, boot, std::move(options))) {
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
  impl_->parts_thread = std::thread([impl = impl_.get()] { impl->serve_parts(); });
  impl_->map_thread = std::thread([impl = impl_.get()] { impl->read_map(); });
}

IngestServer::~IngestServer() { stop(); }

void IngestServer::take_part(KeyframePart part, Sender sender) { impl_->enqueue(std::move(part), std::move(sender)); }

void IngestServer::take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload,
                                const Sender& sender, Taken taken) {
  auto bytes = std::make_shared<Bytes>(std::move(payload));
  impl_->take(
      {session, sequence, sender,
       [=](Intake& intake) { return intake.take_payload(session, sequence, crc, std::move(*bytes), now(), sender); },
       std::move(taken)});
}

void IngestServer::take_gap(const Gap& gap, const Sender& sender, Taken taken) {
  impl_->take({gap.session, std::nullopt, sender, [=](Intake& intake) { return intake.take_gap(gap, now(), sender); },
               std::move(taken)});
}

void IngestServer::take_end(const SessionEnd& end, const Sender& sender, Taken taken) {
  impl_->take({end.session, std::nullopt, sender, [=](Intake& intake) { return intake.take_end(end, now(), sender); },
               std::move(taken)});
}

void IngestServer::claim(const SessionUuid& session, const Sender& sender, Taken taken) {
  impl_->take({session, std::nullopt, sender, [=](Intake& intake) { return intake.claim(session, now(), sender); },
               std::move(taken)});
}

void IngestServer::count_foreign(Reason reason) {
  const MutexLock lock(impl_->mutex);
  impl_->intake.count_foreign(reason);
}

Result<Acknowledgement> IngestServer::acknowledgement(const SessionUuid& session) {
  std::optional<MapQuestion> unread;
  {
    const MutexLock lock(impl_->mutex);
    unread = impl_->intake.question(session, std::nullopt);
  }
  if (unread) impl_->read(*unread);
  const MutexLock lock(impl_->mutex);
  return impl_->intake.acknowledgement(session);
}

IngestStats IngestServer::stats() const {
  IngestStats stats;
  {
    const MutexLock lock(impl_->mutex);
    stats = impl_->intake.stats(now());
  }
  const MutexLock lock(impl_->queue_mutex);
  for (std::size_t i = 0; i < impl_->unsound.size(); ++i) {
    stats.parts += impl_->unsound[i];
    stats.parts_refused[i] += impl_->unsound[i];
  }
  return stats;
}

std::vector<RobotStats> IngestServer::robots() const {
  std::vector<RobotStats> robots;
  {
    const MutexLock lock(impl_->mutex);
    robots = impl_->intake.robots(now());
  }
  const MutexLock lock(impl_->queue_mutex);
  for (RobotStats& robot : robots) {
    for (const Party& party : {Party{robot.uuid, {}}, Party{{}, robot.robot}}) {
      if (party == Party{}) continue;  // what it has not begun waits among others'
      const PartQueue::Facts facts = impl_->queue.of(party);
      robot.queued += facts.waiting;
      robot.dropped += facts.dropped;
    }
  }
  return robots;
}

void IngestServer::limit(const IntakeLimits& limits) {
  const MutexLock lock(impl_->mutex);
  impl_->intake.limit(limits);
}

double IngestServer::busy_s() const { return impl_->busy.seconds(); }

const DaemonIdentity& IngestServer::identity() const { return impl_->identity; }

void IngestServer::tell(PoseNews news, std::string robot) {
  {
    const MutexLock lock(impl_->wake_mutex);
    if (impl_->told.size() >= kMaxNews) return;  // news are not reliable: transports may lose them too
    impl_->told.emplace_back(std::move(news), std::move(robot));
  }
  impl_->wake();
}

std::unique_ptr<IngestServer::Subscription> IngestServer::subscribe(Listener listener) {
  const MutexLock lock(impl_->subscribers_mutex);
  const std::uint64_t id = impl_->next_subscriber++;
  if (impl_->all_said && listener.stopping) listener.stopping();
  impl_->subscribers.emplace(id, std::move(listener));
  return std::make_unique<Entry>(impl_, id);
}

void IngestServer::stop() {
  {
    const MutexLock lock(impl_->queue_mutex);
    impl_->queue_stopping = true;
    impl_->queue_condition.notify_one();
  }
  if (impl_->parts_thread.joinable()) impl_->parts_thread.join();
  {
    const MutexLock lock(impl_->waiting_mutex);
    impl_->waiting_stopping = true;
    impl_->waiting_condition.notify_one();
  }
  if (impl_->map_thread.joinable()) impl_->map_thread.join();
  {
    const MutexLock lock(impl_->mutex);
    impl_->stopped = true;
  }
  {
    const MutexLock lock(impl_->wake_mutex);
    impl_->stopping = true;
    impl_->wake_condition.notify_one();
  }
  if (impl_->thread.joinable()) impl_->thread.join();
}

}  // namespace relmap::intake
