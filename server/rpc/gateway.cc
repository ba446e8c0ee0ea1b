#include "server/rpc/gateway.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <new>
#include <random>

#include "proto/base/hex.h"
#include "server/rpc/caller.h"
#include "server/rpc/error_mapping.h"
#include "server/rpc/roles.h"

namespace relmap::rpc {

namespace {

// Memory charged for every call while it runs: messages, view, working memory of a small question. Searches charge
// theirs separately.
constexpr std::size_t kBytesPerCall = 64 * 1024;
constexpr std::size_t kMaxRequestId = 64;
constexpr int kEditThreads = 2;  // edits take turns (EditLog); one of them may wait until what it wrote is visible
constexpr int kWaitThreads = 4;  // all wait for the same, so more would gain nothing
constexpr std::chrono::milliseconds kWatchInterval{500};

// Whose calls are counted together. Those who prove nothing are told apart by their address.
std::string counted_as(const Identity& caller, std::string peer) {
  if (caller.name != kAnonymous) return caller.name;
  return peer.substr(0, peer.rfind(':'));
}

// The caller's id for the call if it is fit for a log line, or else a random one.
std::string choose_request_id(const grpc::CallbackServerContext& context) {
  const auto given = context.client_metadata().find("x-request-id");
  if (given != context.client_metadata().end()) {
    const std::string id(given->second.data(), given->second.size());
    const auto printable = [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_' || c == '.'; };
    if (!id.empty() && id.size() <= kMaxRequestId && std::all_of(id.begin(), id.end(), printable)) return id;
  }
  thread_local std::mt19937_64 random{std::random_device{}()};
  return hex(std::uint64_t{random()});
}

std::chrono::steady_clock::time_point deadline_of(const grpc::CallbackServerContext& context, double default_s) {
  const auto now = std::chrono::steady_clock::now();
  const auto left = context.deadline() - std::chrono::system_clock::now();
  const auto max_wait = std::chrono::hours(24);
  if (left > max_wait)
    return now +
           std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(default_s));
  return now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(left);
}

}  // namespace

Gateway::Gateway(const RpcLimits& limits, storage::Budget& budget, Metrics& metrics, const Gatekeeper& gatekeeper,
                 AuditLog* audit)
    : limits_(limits),
      budget_(budget),
      metrics_(metrics),
      gatekeeper_(gatekeeper),
      audit_(audit),
      general_(limits.threads),
      picture_thread_(1),
      maintenance_thread_(1),
      edit_threads_(kEditThreads),
      wait_threads_(kWaitThreads) {
  watch_ = std::thread([this] { watch(); });
}

Gateway::~Gateway() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    stop_.notify_all();
  }
  watch_.join();
}

// Cancels calls whose callers take nothing: they would hold memory, and their place among those that may run, for ever.
void Gateway::watch() {
  const MutexLock lock(mutex_);
  for (;;) {
    stop_.wait_for(mutex_, kWatchInterval, [this]() RELMAP_REQUIRES(mutex_) { return stopping_; });
    if (stopping_) return;
    std::vector<Call*> stalled;
    const auto now = std::chrono::steady_clock::now();
    for (Call* call : open_)
      if (call->stalled(now)) stalled.push_back(call);
    for (Call* call : stalled) {
      if (!open_.contains(call)) continue;
      spdlog::warn("{} [{}] from {}: it has taken no message for {} s, and is cancelled", call->method_,
                   call->request_id_, call->context_->peer(), limits_.stalled_s);
      call->written();
      cancelling_ = call;
      {
        const MutexUnlock unlocked(mutex_);  // the call may end in this thread
        call->context_->TryCancel();
      }
      cancelling_ = nullptr;
      stop_.notify_all();
    }
  }
}

// A call that is being cancelled stays until that is done.
void Gateway::forget(Call* call) {
  const MutexLock lock(mutex_);
  open_.erase(call);
  if (std::this_thread::get_id() == watch_.get_id()) return;
  while (cancelling_ == call) stop_.wait(mutex_);
}

Status Gateway::enter(const std::string& caller, Lane lane, std::size_t bytes) {
  const MutexLock lock(mutex_);
  if (lane == Lane::kIngest) {
    if (++streamers_[caller].calls <= limits_.max_ingest_streams_per_caller) return {};
    return {Reason::BUDGET_EXCEEDED, std::to_string(limits_.max_ingest_streams_per_caller) +
                                         " streams of keyframes of " + caller + " are open already"};
  }
  Load& load = callers_[caller];
  load.bytes += bytes;
  if (++load.calls > limits_.max_concurrent_per_caller)
    return {Reason::BUDGET_EXCEEDED,
            std::to_string(limits_.max_concurrent_per_caller) + " calls of " + caller + " are running already"};
  const std::size_t share = budget_.allowance(storage::Share::kReplies);
  if (load.calls > 1 && load.bytes > share / 2)
    return {Reason::BUDGET_EXCEEDED, "calls of " + caller + " use half of the " + std::to_string(share) +
                                         " bytes that the memory budget leaves for replies"};
  return {};
}

void Gateway::leave(const std::string& caller, Lane lane, std::size_t bytes) {
  const MutexLock lock(mutex_);
  auto& loads = lane == Lane::kIngest ? streamers_ : callers_;
  Load& load = loads[caller];
  load.bytes -= lane == Lane::kIngest ? 0 : bytes;
  if (--load.calls == 0) loads.erase(caller);
}

Call::Call(Gateway& gateway, grpc::CallbackServerContext* context, const char* method, Lane lane)
    : gateway_(gateway),
      context_(context),
      method_(method),
      lane_(lane),
      request_id_(choose_request_id(*context)),
      deadline_{deadline_of(*context, gateway.limits_.default_deadline_s), [this]() -> Status {
                  if (gateway_.draining_) return {Reason::SHUTTING_DOWN, "the daemon is stopping"};
                  if (cancelled_) return {Reason::DEADLINE, "the caller has gone"};
                  return check_caller();
                }} {
  context_->AddInitialMetadata("x-request-id", request_id_);
}

Call::~Call() {
  leave();
  if (!counted_) return;
  gateway_.forget(this);
  --gateway_.calls_;
}

bool Call::stalled(std::chrono::steady_clock::time_point now) const {
  const std::int64_t since = writing_since_;
  if (since == 0) return false;
  const std::chrono::duration<double> waited = now.time_since_epoch() - std::chrono::steady_clock::duration(since);
  return waited.count() > gateway_.limits_.stalled_s;
}

void Call::leave() {
  if (!running_) return;
  running_ = false;
  if (entered_) gateway_.leave(entered_as_, lane_, entered_bytes_);
  if (lane_ == Lane::kIngest) {
    --gateway_.ingest_;
    return;
  }
  if (lane_ == Lane::kEdits || lane_ == Lane::kWaits) {
    --(lane_ == Lane::kEdits ? gateway_.edits_ : gateway_.waits_);
    return;
  }
  --gateway_.running_;
  if (lane_ == Lane::kPictures) --gateway_.pictures_;
}

// Who calls, and whether they may, and may once more.
Status Call::admit_caller(std::size_t bytes) {
  auto caller = gateway_.gatekeeper_.identify(evidence_of(*context_, *context_->auth_context()));
  if (!caller.ok()) return caller.status();
  caller_ = std::move(*caller);
  if (Status may = check_role(caller_); !may.ok()) return may;
  entered_as_ = counted_as(caller_, context_->peer());
  entered_ = true;
  entered_bytes_ = bytes;
  return gateway_.enter(entered_as_, lane_, bytes);
}

Status Call::admit(std::size_t more) {
  counted_ = true;
  ++gateway_.calls_;
  {
    const MutexLock lock(gateway_.mutex_);
    gateway_.open_.insert(this);
  }
  const Status may = admit_caller(kBytesPerCall + more);
  if (!may.ok() && !entered_) return may;
  running_ = true;
  if (lane_ == Lane::kIngest) {
    const int streams = ++gateway_.ingest_;
    if (!may.ok()) return may;
    if (gateway_.draining_) return {Reason::SHUTTING_DOWN, "the daemon is stopping"};
    if (streams > gateway_.limits_.max_ingest_streams)
      return {Reason::BUDGET_EXCEEDED,
              std::to_string(gateway_.limits_.max_ingest_streams) + " streams of keyframes are open already"};
    // Streams must leave room for answers.
    const std::size_t share = gateway_.budget_.allowance(storage::Share::kReplies);
    if (static_cast<std::size_t>(streams) * (kBytesPerCall + more) > share / 2)
      return {Reason::BUDGET_EXCEEDED, "open streams of keyframes use half of the " + std::to_string(share) +
                                           " bytes that the memory budget leaves for replies"};
    charge_.emplace(gateway_.budget_, storage::Share::kReplies);
    return charge_->grow_to(kBytesPerCall + more);
  }
  if (lane_ == Lane::kEdits || lane_ == Lane::kWaits) {
    const int waiting = ++(lane_ == Lane::kEdits ? gateway_.edits_ : gateway_.waits_);
    if (!may.ok()) return may;
    if (gateway_.draining_) return {Reason::SHUTTING_DOWN, "the daemon is stopping"};
    if (waiting > gateway_.limits_.max_waiting)
      return {Reason::BUDGET_EXCEEDED, std::to_string(gateway_.limits_.max_waiting) + " such calls wait already"};
    charge_.emplace(gateway_.budget_, storage::Share::kReplies);
    return charge_->grow_to(kBytesPerCall + more);
  }
  const int running = ++gateway_.running_;
  const int pictures = lane_ == Lane::kPictures ? ++gateway_.pictures_ : 0;
  if (!may.ok()) return may;
  if (gateway_.draining_) return {Reason::SHUTTING_DOWN, "the daemon is stopping"};
  if (running > gateway_.limits_.max_concurrent)
    return {Reason::BUDGET_EXCEEDED, std::to_string(gateway_.limits_.max_concurrent) + " calls are running already"};
  if (pictures > gateway_.limits_.max_pictures)
    return {Reason::BUDGET_EXCEEDED, std::to_string(gateway_.limits_.max_pictures) + " pictures are waiting already"};
  charge_.emplace(gateway_.budget_, storage::Share::kReplies);
  if (Status status = charge_->grow_to(kBytesPerCall); !status.ok()) return status;
  // The picture that is being described has reserved memory; those that wait behind it do not.
  if (lane_ == Lane::kPictures && pictures == 1) return {};
  // Waiting pictures must leave room for the replies of other calls.
  const std::size_t share = gateway_.budget_.allowance(storage::Share::kReplies);
  if (lane_ == Lane::kPictures && gateway_.budget_.used(storage::Share::kReplies) + more > share / 2)
    return {Reason::BUDGET_EXCEEDED, "waiting pictures use half of the " + std::to_string(share) +
                                         " bytes that the memory budget leaves for replies"};
  return charge_->grow_to(kBytesPerCall + more);
}

Status Call::check_role(const Identity& caller) const {
  const auto required = required_role(method_);
  if (required && caller.role >= *required) return {};
  return {Reason::NOT_ALLOWED, std::string(method_) + " is for the role " +
                                   std::string(access::role_name(required.value_or(Role::kOperator))) + ", and " +
                                   caller.name + " has the role " + std::string(access::role_name(caller.role))};
}

Status Call::check_caller() const {
  if (gateway_.gatekeeper_.is_current(caller_)) return {};
  const auto now = gateway_.gatekeeper_.identify(evidence_of(*context_, *context_->auth_context()));
  if (!now.ok()) return now.status();
  if (Status may = check_role(*now); !may.ok()) return may;
  return now->name == caller_.name && now->role == caller_.role
             ? Status()
             : Status(Reason::UNAUTHENTICATED, "the credentials of " + caller_.name + " have changed");
}

void Call::post(std::function<void()> task) {
  TaskPool& pool = lane_ == Lane::kPictures      ? gateway_.picture_thread_
                   : lane_ == Lane::kMaintenance ? gateway_.maintenance_thread_
                   : lane_ == Lane::kEdits       ? gateway_.edit_threads_
                   : lane_ == Lane::kWaits       ? gateway_.wait_threads_
                                                 : gateway_.general_;
  pool.post(std::move(task));
}

void Call::asks(const google::protobuf::Message& request) {
  if (gateway_.audit_ && is_audited(method_)) asked_ = AuditLog::text_of(request);
}

grpc::Status Call::end(const Status& status) {
  leave();
  writing();
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - begun_);
  gateway_.metrics_.count(method_, status.reason(), took);
  if (status.reason() == Reason::INTERNAL || status.reason() == Reason::IO_ERROR ||
      status.reason() == Reason::DATA_LOSS)
    spdlog::error("{} [{}] from {}: {}", method_, request_id_, context_->peer(), status.to_string());
  else
    spdlog::debug("{} [{}] from {}: {} in {} us", method_, request_id_, context_->peer(), status.to_string(),
                  took.count());
  if (gateway_.audit_ && is_audited(method_)) {
    AuditLog::Entry entry;
    entry.who = caller_.name;
    entry.role = std::string(access::role_name(caller_.role));
    entry.from = context_->peer();
    entry.method = method_;
    entry.request = asked_;
    entry.request_id = request_id_;
    entry.outcome = status;
    entry.took = took;
    gateway_.audit_->write(entry);
  }
  return to_grpc(status, request_id_);
}

Status Call::from_current_exception() {
  try {
    throw;
  } catch (const StatusError& error) {
    return error.status();
  } catch (const std::bad_alloc&) {
    return {Reason::BUDGET_EXCEEDED, "out of memory"};
  } catch (const std::exception& error) {
    return {Reason::INTERNAL, error.what()};
  }
}

}  // namespace relmap::rpc
