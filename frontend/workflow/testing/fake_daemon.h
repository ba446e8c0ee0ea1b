// A fake daemon for tests of workflows: takes keyframes, refuses them and sends news of them as the test says.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frontend/sink.h"
#include "frontend/workflow/outside.h"
#include "frontend/workflow/run_options.h"

namespace relmap::workflow::testing_daemon {

// Must outlive the sinks that it opens. The test sets the first fields before the run and reads the others after it.
class FakeDaemon {
 public:
  // Set by the test.
  Status refuses_to_open, refuses_to_push;                      // if not ok, what open and push answer
  std::size_t takes = std::numeric_limits<std::size_t>::max();  // number of keyframes before it refuses one
  std::vector<Status> maps;  // what await_map() answers, one after another, before ok
  bool answers = true, settles = true;
  bool takes_after_interrupt = false;  // as a file sink does
  Status trouble;
  Status session;                                                    // PublishSummary::session
  publishing::PublishSummary at_end;                                 // the other fields of the summary
  std::optional<Keyframe> last;                                      // the last keyframe in its spool
  std::function<void(std::size_t)> pushed_one = [](std::size_t) {};  // called with the number of keyframes so far
  // Called at the beginning of each call that changes a sink: open, push, interrupt, finish, end_session, ignore (a
  // listener is unregistered) or close (the sink's destructor). Interrupts come from a thread of the delivery.
  std::function<void(const std::string&)> at_call = [](const std::string&) {};

  // Found by the test.
  std::vector<publishing::PublisherOptions> opened;
  std::vector<Keyframe> pushed;
  std::optional<bool> complete;  // argument of finish()
  std::optional<double> patience;
  int ends = 0;  // calls of end_session()
  bool interrupted = false;

  // The calls that at_call was told of, in order.
  std::vector<std::string> calls() {
    const std::lock_guard lock(mutex_);
    return calls_;
  }

  // Waits until the delivery has interrupted a sink, which then takes nothing more.
  void await_interrupt() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return interrupted; });
  }

  // Sends news to the listener, if there is one.
  void tell(const PoseNews& news) {
    const std::lock_guard lock(mutex_);
    if (listener_) listener_(news);
  }

  // For Outside::open_daemon_sink.
  auto opener() {
    return [this](const RunOptions&, const publishing::PublisherOptions& publisher,
                  const SessionHeader& session_header) -> Result<std::unique_ptr<frontend::KeyframeSink>> {
      note("open");
      opened.push_back(publisher);
      if (!refuses_to_open.ok()) return refuses_to_open;
      return std::unique_ptr<frontend::KeyframeSink>(std::make_unique<Sink>(*this, session_header));
    };
  }

 private:
  class Sink : public frontend::KeyframeSink {
   public:
    Sink(FakeDaemon& daemon, SessionHeader session) : daemon_(daemon), session_(std::move(session)) {
      if (session_.uuid.is_nil()) session_.uuid = SessionUuid::random();
    }
    ~Sink() override {
      daemon_.note("close");
      const std::lock_guard lock(daemon_.mutex_);
      daemon_.listener_ = {};
    }
    const SessionHeader& session() const override { return session_; }
    std::optional<Keyframe> last_keyframe() const override { return daemon_.last; }
    Status await_map(double) override {
      if (daemon_.maps.empty()) return {};
      const Status answer = daemon_.maps.front();
      daemon_.maps.erase(daemon_.maps.begin());
      return answer;
    }
    Status push(const Keyframe& keyframe) override {
      daemon_.note("push");
      std::size_t count = 0;
      {
        const std::lock_guard lock(daemon_.mutex_);
        if (daemon_.interrupted && !daemon_.takes_after_interrupt) return {Reason::SHUTTING_DOWN, "interrupted"};
        if (daemon_.pushed.size() >= daemon_.takes) return daemon_.refuses_to_push;
        daemon_.pushed.push_back(keyframe);
        count = daemon_.pushed.size();
      }
      daemon_.pushed_one(count);
      return {};
    }
    void hear(std::function<void(const PoseNews&)> listener) override {
      if (!listener) daemon_.note("ignore");
      const std::lock_guard lock(daemon_.mutex_);
      daemon_.listener_ = std::move(listener);
    }
    publishing::PublishSummary progress() const override {
      const std::lock_guard lock(daemon_.mutex_);
      publishing::PublishSummary summary = daemon_.at_end;
      summary.pushed = daemon_.pushed.size();
      (daemon_.settles ? summary.settled : summary.unsettled) = summary.pushed;
      summary.heard = daemon_.answers;
      summary.session = daemon_.session;
      return summary;
    }
    Result<publishing::PublishSummary> finish(double patience_s, bool complete) override {
      daemon_.note("finish");
      daemon_.complete = complete;
      daemon_.patience = patience_s;
      return progress();
    }
    void end_session(double) override {
      daemon_.note("end_session");
      ++daemon_.ends;
    }
    Status trouble() const override { return daemon_.trouble; }
    void interrupt() override {
      daemon_.note("interrupt");
      const std::lock_guard lock(daemon_.mutex_);
      daemon_.interrupted = true;
      daemon_.changed_.notify_all();
    }

   private:
    FakeDaemon& daemon_;
    SessionHeader session_;
  };

  void note(const std::string& call) {
    at_call(call);
    const std::lock_guard lock(mutex_);
    calls_.push_back(call);
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void(const PoseNews&)> listener_;
  std::vector<std::string> calls_;
};

}  // namespace relmap::workflow::testing_daemon
