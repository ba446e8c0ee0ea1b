// The one way in: every RPC passes  identity -> role -> deadline -> admission and budget -> metrics -> request id ->
// handler -> error mapping.  Handlers know nothing of gRPC; adapters (*_service.cc) only name them.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/rpc/charge.h"
#include "server/rpc/deadline.h"
#include "server/rpc/limits.h"
#include "server/rpc/metrics.h"
#include "server/rpc/producer.h"
#include "server/rpc/task_pool.h"
#include "storage/memory/budget.h"

namespace relmap::rpc {

// Pictures are described one at a time, by a thread of their own (they need a fixed reserve of memory). Streams of
// maintenance wait for work of hours on a third kind of thread, so that no query waits behind them. Streams of
// keyframes last as long as a robot drives: they have a limit of their own, no deadline, and no thread.
enum class Lane : std::uint8_t { kGeneral, kPictures, kMaintenance, kIngest };

class Gateway {
 public:
  // `budget` and `metrics` must outlive it.
  Gateway(const RpcLimits& limits, storage::Budget& budget, Metrics& metrics);

  // From now on new calls are refused with SHUTTING_DOWN and running ones see their deadline passed.
  void drain() { draining_ = true; }
  // Calls that gRPC has not let go of yet: their answers may still be on their way.
  int calls() const { return calls_; }

  // `handler`: Result<Reply>(const Request&, const Deadline&).
  template <typename Request, typename Reply, typename Handler>
  grpc::ServerUnaryReactor* unary(grpc::CallbackServerContext* context, const char* method, Lane lane,
                                  const Request* request, Reply* reply, Handler handler);
  // `handler`: Result<Producer<Reply>>(const Request&, const Deadline&). The request lives until the stream ends.
  template <typename Reply, typename Request, typename Handler>
  grpc::ServerWriteReactor<Reply>* stream(grpc::CallbackServerContext* context, const char* method, Lane lane,
                                          const Request* request, Handler handler);

 private:
  friend class Call;

  const RpcLimits limits_;
  storage::Budget& budget_;
  Metrics& metrics_;
  std::atomic<bool> draining_{false};
  std::atomic<int> calls_{0};
  std::atomic<int> running_{0}, pictures_{0},
      ingest_{0};  // until they are answered: gRPC may be late in letting go of them
  TaskPool general_, picture_thread_, maintenance_thread_;  // last: joined first
};

// What one call is, whatever its kind of reply.
class Call {
 public:
  Call(Gateway& gateway, grpc::CallbackServerContext* context, const char* method, Lane lane);
  ~Call();

  // Role, protocol version, admission, budget: a call of usual size, and `more` bytes. Once, first.
  Status admit(std::size_t more);
  const Deadline& deadline() const { return deadline_; }
  std::string peer() const { return context_->peer(); }
  void cancel() { cancelled_ = true; }
  void post(std::function<void()> task);
  // Counts and logs; what the caller gets. Once, last.
  grpc::Status end(const Status& status);

  // Runs `body`, which returns a Status, and turns what it throws into one.
  template <typename Body>
  Status guarded(Body body);

 private:
  static Status from_current_exception();
  void leave();

  Gateway& gateway_;
  grpc::CallbackServerContext* const context_;
  const char* const method_;
  const Lane lane_;
  const std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  std::string request_id_;
  std::atomic<bool> cancelled_{false};
  Deadline deadline_;
  bool counted_ = false, running_ = false;
  std::optional<Charge> charge_;
};

template <typename Body>
Status Call::guarded(Body body) {
  try {
    return body();
  } catch (...) {
    return from_current_exception();
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
  // A step takes one message from the producer and writes it; the next step is posted when the caller has taken it, so
  // that a slow caller holds no thread.
  class Reactor final : public grpc::ServerWriteReactor<Reply> {
   public:
    Reactor(Gateway& gateway, grpc::CallbackServerContext* c, const char* m, Lane l) : call(gateway, c, m, l) {}
    void OnCancel() override { call.cancel(); }
    void OnDone() override { delete this; }
    void OnWriteDone(bool ok) override {
      if (!ok) call.cancel();
      call.post([this] { step(); });
    }
    void step() {
      bool more = false;
      const Status status = call.guarded([&]() -> Status {
        if (Status late = call.deadline().check(); !late.ok()) return late;
        auto next = producer();
        if (!next.ok()) return next.status();
        more = next->has_value();
        if (more) message = std::move(**next);
        return {};
      });
      if (status.ok() && more) return this->StartWrite(&message);
      producer = nullptr;
      this->Finish(call.end(status));
    }
    Call call;
    Producer<Reply> producer;
    Reply message;
  };
  auto* reactor = new Reactor(*this, context, method, lane);
  if (Status status = reactor->call.admit(request->ByteSizeLong() + 2 * kUsualStreamMessageBytes); !status.ok()) {
    reactor->Finish(reactor->call.end(status));
    return reactor;
  }
  reactor->call.post([reactor, request, handler = std::move(handler)] {
    Call& call = reactor->call;
    const Status status = call.guarded([&]() -> Status {
      if (Status late = call.deadline().check(); !late.ok()) return late;
      auto producer = handler(*request, call.deadline());
      if (producer.ok()) reactor->producer = std::move(producer).value();
      return producer.status();
    });
    if (status.ok()) return reactor->step();
    reactor->Finish(call.end(status));
  });
  return reactor;
}

}  // namespace relmap::rpc
