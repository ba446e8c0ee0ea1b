// The gateway of all RPCs. Each passes identity -> role -> deadline -> admission and budget -> metrics -> request id ->
// handler -> error mapping. Handlers know nothing of gRPC; the adapters (*_service.cc) only name them.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "proto/base/mutex.h"
#include "server/rpc/audit_log.h"
#include "server/rpc/charge.h"
#include "server/rpc/connections.h"
#include "server/rpc/deadline.h"
#include "server/rpc/gatekeeper.h"
#include "server/rpc/limits.h"
#include "server/rpc/metrics.h"
#include "server/rpc/producer.h"
#include "server/rpc/request_context.h"
#include "server/rpc/task_pool.h"
#include "storage/memory/budget.h"

namespace relmap::rpc {

// The lanes of calls, which have separate threads and limits. Pictures are described one at a time by a thread of their
// own, since this needs a fixed reserve of memory. Maintenance streams wait for hours of work on another thread, so
// that no query waits behind them. Edits wait for the disk, and WaitIdle for all that was sent: each kind has threads
// and a limit of its own, so that many of them hold up nothing else. What waits for the disk must be in one of these
// two, or in maintenance. Streams of keyframes last as long as a robot drives: they have a limit of their own, but no
// deadline and no thread. Watches last as long as somebody looks: they have a limit of their own, one thread together,
// and no deadline but their caller's. A watcher who takes no message is not cut off: he holds one message, and that is
// all that he costs.
enum class Lane : std::uint8_t { kGeneral, kPictures, kMaintenance, kIngest, kEdits, kWaits, kWatches };

class Call;

class Gateway {
 public:
  // All but `limits` must outlive it. `connections` are told whose callers are known. `audit`: where edits and calls of
  // operators are written down; null: nowhere.
  Gateway(const RpcLimits& limits, storage::Budget& budget, Metrics& metrics, const Gatekeeper& gatekeeper,
          Connections& connections, AuditLog* audit = nullptr);
  ~Gateway();

  // From now on refuses new calls with SHUTTING_DOWN and interrupts running ones (Deadline::check()).
  void drain();
  // The number of calls that gRPC still holds; their answers may still be in transit.
  int calls() const { return calls_; }
  // Lanes whose calls are counted together, so that those of others have room.
  enum class Kind : std::uint8_t { kQuestion, kStream, kEdit, kWait, kWatch };
  static constexpr std::size_t kKinds = 5;
  // The number of calls of the kind that are not answered yet.
  int running(Kind kind) const { return running_[static_cast<std::size_t>(kind)]; }

  // Answers a unary call. `handler` is a Result<Reply>(const Request&, const Deadline&).
  template <typename Request, typename Reply, typename Handler>
  grpc::ServerUnaryReactor* unary(grpc::CallbackServerContext* context, const char* method, Lane lane,
                                  const Request* request, Reply* reply, Handler handler);
  // Answers with a stream. `handler` is a Result<Producer<Reply>>(const Request&, const Deadline&), or returns a
  // LiveProducer, whose stream may wait. The request lives until the stream ends.
  template <typename Reply, typename Request, typename Handler>
  grpc::ServerWriteReactor<Reply>* stream(grpc::CallbackServerContext* context, const char* method, Lane lane,
                                          const Request* request, Handler handler);

 private:
  friend class Call;

  void watch();
  void cancel(Call* call, const std::string& why) RELMAP_REQUIRES(mutex_);
  void forget(Call* call);
  static Kind kind_of(Lane lane);
  struct Limit {
    int all, per_caller;
    const char *what, *state;  // for messages: "calls", "are running"
  };
  Limit limit_of(Kind kind) const;
  // Whether its calls last long, wait for others mostly, and have memory of their own: not part of what a caller may
  // use for the answers to his questions.
  static bool lasts(Kind kind) { return kind == Kind::kStream || kind == Kind::kWatch; }
  // The calls of one caller, and the memory that they hold for replies, those that last apart.
  struct Load {
    std::array<int, kKinds> calls{};
    std::size_t bytes = 0;
  };
  // Counts a call of this caller; BUDGET_EXCEEDED if it has as many as one may have, or half of the memory for replies.
  Status enter(const std::string& caller, Lane lane, std::size_t bytes);
  void leave(const std::string& caller, Lane lane, std::size_t bytes);
  // Whether the log is to tell that the caller may not call what he did; once a minute for each.
  bool tells_of(const std::string& call);
  TaskPool& threads_of(Lane lane);

  const RpcLimits limits_;
  storage::Budget& budget_;
  Metrics& metrics_;
  const Gatekeeper& gatekeeper_;
  Connections& connections_;
  AuditLog* const audit_;
  std::atomic<bool> draining_{false};
  std::atomic<int> calls_{0};
  // Calls that are not answered yet; gRPC may hold a call a little longer.
  std::array<std::atomic<int>, kKinds> running_{};
  std::atomic<int> pictures_{0};  // of these

  Mutex mutex_;
  ConditionVariable stop_;
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  bool look_ RELMAP_GUARDED_BY(mutex_) = false;                    // at all calls, now
  std::set<Call*> open_ RELMAP_GUARDED_BY(mutex_);                 // admitted, and not destroyed yet
  Call* cancelling_ RELMAP_GUARDED_BY(mutex_) = nullptr;           // by watch_, which is about to cancel it
  std::map<std::string, Load> callers_ RELMAP_GUARDED_BY(mutex_);  // those who have calls that run
  std::map<std::string, std::chrono::steady_clock::time_point> told_of_ RELMAP_GUARDED_BY(mutex_);
  // Declared last, so that they are joined first.
  TaskPool general_, picture_thread_, maintenance_thread_, edit_threads_, wait_threads_, watch_thread_;
  std::thread watch_;
};

// One call, unary or stream.
class Call {
 public:
  Call(Gateway& gateway, grpc::CallbackServerContext* context, const char* method, Lane lane);
  ~Call();

  // Checks identity, role, admission and budget, and charges a call of usual size plus `more` bytes. Must be called
  // first, once.
  Status admit(std::size_t more);
  // Who calls, once admitted.
  const Identity& caller() const { return caller_; }
  // Not OK once the caller's credentials have expired or were revoked during the call: UNAUTHENTICATED, NOT_ALLOWED.
  // deadline().check() includes it. Thread-safe.
  Status check_caller() const;
  const Deadline& deadline() const { return deadline_; }
  std::string peer() const { return context_->peer(); }
  // Where a caller who proves nothing comes from, without a port; empty for all others.
  std::string unproved_from() const { return caller_.name == access::kAnonymousName ? entered_as_ : std::string(); }
  // What is asked, for the audit log, if the method is one that it has.
  void asks(const google::protobuf::Message& request);
  // A message was given to gRPC, or has left it. A call whose message does not leave in time is cancelled.
  void writing() { writing_since_ = std::chrono::steady_clock::now().time_since_epoch().count(); }
  void written() { writing_since_ = 0; }
  void cancel() {
    cancelled_ = true;
    wake();
  }
  void post(std::function<void()> task);

  // For a stream that waits. `resume` is its next step, which is posted when wake() is called after wait(), or was
  // since the last step began to look for something to send; at `until` at the latest; and when the call is to end.
  // After wait() the call may be at its next step already, and must not be touched.
  void resume_with(std::function<void()> resume) { resume_ = std::move(resume); }
  void wait(std::chrono::steady_clock::time_point until);
  void wake();  // thread-safe
  // Counts and logs the call, and returns what the caller gets, to be written at once. Must be called last, once.
  grpc::Status end(const Status& status);

  // Runs `body`, which returns a Status, and turns exceptions into a Status.
  template <typename Body>
  Status guarded(Body body);

 private:
  friend class Gateway;

  Status admit_caller(std::size_t bytes);
  Status check_role(const Identity& caller) const;
  void leave();
  // Why it is to be cancelled, since its caller takes no message; OK if it is not.
  Status stalled(std::chrono::steady_clock::time_point now) const;
  void look(std::chrono::steady_clock::time_point now);

  Gateway& gateway_;
  grpc::CallbackServerContext* const context_;
  const char* const method_;
  const Lane lane_;
  const std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  RequestContext request_;
  Identity caller_;
  std::atomic<bool> cancelled_{false};
  Deadline deadline_;
  std::atomic<std::int64_t> writing_since_{0};                  // 0: nothing is being written
  enum class Sleep : std::uint8_t { kAwake, kAsleep, kWoken };  // kWoken: while it was awake
  std::atomic<Sleep> sleep_{Sleep::kAwake};
  std::atomic<std::int64_t> wake_at_{0};
  std::function<void()> resume_;
  bool counted_ = false, running_ = false, entered_ = false;
  std::string known_peer_;  // over whose connection a known caller calls; empty: the caller is not known
  std::string entered_as_;  // whose calls it is counted among
  std::size_t entered_bytes_ = 0;
  std::string asked_;     // the request, for the audit log
  bool goes_on_ = false;  // it asks for another page of a list
  std::optional<Charge> charge_;
};

template <typename Body>
Status Call::guarded(Body body) {
  const RequestScope scope(request_);
  try {
    return body();
  } catch (...) {
    return caught_status();
  }
}

template <typename Request, typename Reply, typename Handler>
grpc::ServerUnaryReactor* Gateway::unary(grpc::CallbackServerContext* context, const char* method, Lane lane,
                                         const Request* request, Reply* reply, Handler handler) {
  class Reactor final : public grpc::ServerUnaryReactor {
   public:
    Reactor(Gateway& gateway, grpc::CallbackServerContext* c, const char* m, Lane l) : call(gateway, c, m, l) {}
    void OnCancel() override { call.cancel(); }
    void OnDone() override { delete this; }
    Call call;
  };
  auto* reactor = new Reactor(*this, context, method, lane);
  reactor->call.asks(*request);
  if (Status status = reactor->call.admit(request->ByteSizeLong()); !status.ok()) {
    reactor->Finish(reactor->call.end(status));
    return reactor;
  }
  reactor->call.post([reactor, request, reply, handler = std::move(handler)] {
    Call& call = reactor->call;
    const Status status = call.guarded([&]() -> Status {
      if (Status late = call.deadline().check(); !late.ok()) return late;
      auto result = handler(*request, call.deadline());
      if (result.ok()) *reply = std::move(result).value();
      return result.status();
    });
    reactor->Finish(call.end(status));
  });
  return reactor;
}

template <typename Reply, typename Request, typename Handler>
grpc::ServerWriteReactor<Reply>* Gateway::stream(grpc::CallbackServerContext* context, const char* method, Lane lane,
                                                 const Request* request, Handler handler) {
  // A step takes one message from the producer and writes it. The next step is posted when the caller has taken the
  // message, or when the stream is woken, so neither a slow caller nor a map that is quiet holds a thread.
  class Reactor final : public grpc::ServerWriteReactor<Reply> {
   public:
    Reactor(Gateway& gateway, grpc::CallbackServerContext* c, const char* m, Lane l) : call(gateway, c, m, l) {
      call.resume_with([this] { step(); });
    }
    void OnCancel() override { call.cancel(); }
    void OnDone() override { delete this; }
    void OnWriteDone(bool ok) override {
      call.written();
      if (!ok) call.cancel();
      call.post([this] { step(); });
    }
    void step() {
      bool more = false;
      std::optional<Waiting> waiting;
      const Status status = call.guarded([&]() -> Status {
        if (Status late = call.deadline().check(); !late.ok()) return late;
        auto next = producer(wake);
        if (!next.ok()) return next.status();
        if (!next->has_value()) return {};
        if (const auto* wait = std::get_if<Waiting>(&**next)) {
          waiting = *wait;
          return {};
        }
        more = true;
        message = std::move(std::get<Reply>(**next));
        return {};
      });
      if (status.ok() && waiting) return call.wait(waiting->until);
      if (status.ok() && more) {
        call.writing();
        return this->StartWrite(&message);
      }
      producer = nullptr;
      this->Finish(call.end(status));
    }
    Call call;
    const Wake wake = [this] { call.wake(); };
    LiveProducer<Reply> producer;
    Reply message;
  };
  auto* reactor = new Reactor(*this, context, method, lane);
  reactor->call.asks(*request);
  if (Status status = reactor->call.admit(request->ByteSizeLong() + 2 * kUsualStreamMessageBytes); !status.ok()) {
    reactor->Finish(reactor->call.end(status));
    return reactor;
  }
  reactor->call.post([reactor, request, handler = std::move(handler)] {
    Call& call = reactor->call;
    const Status status = call.guarded([&]() -> Status {
      if (Status late = call.deadline().check(); !late.ok()) return late;
      auto producer = handler(*request, call.deadline());
      if (producer.ok()) reactor->producer = live(std::move(producer).value());
      return producer.status();
    });
    if (status.ok()) return reactor->step();
    reactor->Finish(call.end(status));
  });
  return reactor;
}

}  // namespace relmap::rpc
