#include "server/rpc/gateway.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
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
constexpr int kEditThreads = 4;   // edits take turns (EditLog); others may wait until what they wrote is visible
constexpr int kWaitThreads = 4;   // all wait for the same, so more would gain nothing
constexpr int kWatchThreads = 1;  // so that many watchers take no more than one core
constexpr std::chrono::milliseconds kLookInterval{500};
constexpr std::chrono::seconds kLeaves{1};  // that a watcher who takes nothing gets to take the end of his stream
constexpr std::chrono::minutes kTold{1};    // between lines in the log of what one caller may not call
constexpr std::size_t kMaxTold = 256;       // lines in that time

// Whose calls are counted together. Those who prove nothing are told apart by their address.
std::string counted_as(const Identity& caller, std::string peer) {
  if (caller.name != access::kAnonymousName) return std::string(access::role_name(caller.role)) + " " + caller.name;
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

std::string traceparent_of(const grpc::CallbackServerContext& context) {
  const auto given = context.client_metadata().find("traceparent");
  if (given == context.client_metadata().end()) return "";
  return checked_traceparent({given->second.data(), given->second.size()});
}

std::chrono::steady_clock::time_point deadline_of(const grpc::CallbackServerContext& context, Lane lane,
                                                  double default_s) {
  const auto now = std::chrono::steady_clock::now();
  const auto left = context.deadline() - std::chrono::system_clock::now();
  const auto max_wait = std::chrono::hours(24);
  if (left > max_wait && lane == Lane::kWatches) return std::chrono::steady_clock::time_point::max();
  if (left > max_wait)
    return now +
           std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(default_s));
  return now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(left);
}

}  // namespace

Gateway::Gateway(const RpcLimits& limits, storage::Budget& budget, Metrics& metrics, const Gatekeeper& gatekeeper,
                 Connections& connections, AuditLog* audit)
    : limits_(limits),
      budget_(budget),
      metrics_(metrics),
      gatekeeper_(gatekeeper),
      connections_(connections),
      audit_(audit),
      general_(limits.threads),
      picture_thread_(1),
      maintenance_thread_(1),
      edit_threads_(kEditThreads),
      wait_threads_(kWaitThreads),
      watch_thread_(kWatchThreads) {
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

void Gateway::drain() {
  const MutexLock lock(mutex_);
  draining_ = true;
  look_ = true;
  stop_.notify_all();
}

// Wakes streams that wait and whose time has come, and cancels calls whose callers take nothing: they would hold
// memory, and their place among those that may run, for ever.
void Gateway::watch() {
  const MutexLock lock(mutex_);
  for (;;) {
    stop_.wait_for(mutex_, kLookInterval, [this]() RELMAP_REQUIRES(mutex_) { return stopping_ || look_; });
    if (stopping_) return;
    look_ = false;
    std::vector<std::pair<Call*, Status>> stalled;
    const auto now = std::chrono::steady_clock::now();
    for (Call* call : open_) {
      call->look(now);
      if (Status why = call->stalled(now); !why.ok()) stalled.emplace_back(call, std::move(why));
    }
    for (const auto& [call, why] : stalled)
      if (open_.contains(call)) cancel(call, why.message());
  }
}

void Gateway::cancel(Call* call, const std::string& why) {
  {
    const RequestScope scope(call->request_);
    spdlog::warn("{} from {}: {}, and is cancelled", call->method_, call->context_->peer(), why);
  }
  call->written();
  cancelling_ = call;
  {
    const MutexUnlock unlocked(mutex_);  // the call may end in this thread
    call->context_->TryCancel();
  }
  cancelling_ = nullptr;
  stop_.notify_all();
}

// A call that is being cancelled stays until that is done.
void Gateway::forget(Call* call) {
  const MutexLock lock(mutex_);
  open_.erase(call);
  if (std::this_thread::get_id() == watch_.get_id()) return;
  while (cancelling_ == call) stop_.wait(mutex_);
}

Gateway::Kind Gateway::kind_of(Lane lane) {
  switch (lane) {
    case Lane::kIngest:
      return Kind::kStream;
    case Lane::kEdits:
      return Kind::kEdit;
    case Lane::kWaits:
      return Kind::kWait;
    case Lane::kWatches:
      return Kind::kWatch;
    case Lane::kGeneral:
    case Lane::kPictures:
    case Lane::kMaintenance:
      break;
  }
  return Kind::kQuestion;
}

Gateway::Limit Gateway::limit_of(Kind kind) const {
  switch (kind) {
    case Kind::kStream:
      return {limits_.max_ingest_streams, limits_.max_ingest_streams_per_caller, "streams of keyframes", "are open"};
    case Kind::kEdit:
      return {limits_.max_waiting, limits_.max_concurrent_per_caller, "edits", "wait"};
    case Kind::kWait:
      return {limits_.max_waiting, limits_.max_concurrent_per_caller, "calls of WaitIdle", "wait"};
    case Kind::kWatch:
      return {limits_.max_watchers, limits_.max_watchers_per_caller, "watches", "are open"};
    case Kind::kQuestion:
      break;
  }
  return {limits_.max_concurrent, limits_.max_concurrent_per_caller, "calls", "are running"};
}

TaskPool& Gateway::threads_of(Lane lane) {
  switch (lane) {
    case Lane::kPictures:
      return picture_thread_;
    case Lane::kMaintenance:
      return maintenance_thread_;
    case Lane::kEdits:
      return edit_threads_;
    case Lane::kWaits:
      return wait_threads_;
    case Lane::kWatches:
      return watch_thread_;
    case Lane::kGeneral:
    case Lane::kIngest:
      break;
  }
  return general_;
}

Status Gateway::enter(const std::string& caller, Lane lane, std::size_t bytes) {
  const Kind kind = kind_of(lane);
  const Limit limit = limit_of(kind);
  const MutexLock lock(mutex_);
  Load& load = callers_[caller];
  const bool first = load.bytes == 0;
  load.bytes += bytes;
  if (++load.calls[static_cast<std::size_t>(kind)] > limit.per_caller)
    return {Reason::BUDGET_EXCEEDED,
            std::to_string(limit.per_caller) + " " + limit.what + " of " + caller + " " + limit.state + " already"};
  if (lasts(kind)) return {};
  const std::size_t share = budget_.allowance(storage::Share::kReplies);
  if (!first && load.bytes > share / 2)
    return {Reason::BUDGET_EXCEEDED, "calls of " + caller + " use half of the " + std::to_string(share) +
                                         " bytes that the memory budget leaves for replies"};
  return {};
}

void Gateway::leave(const std::string& caller, Lane lane, std::size_t bytes) {
  const MutexLock lock(mutex_);
  const auto load = callers_.find(caller);
  load->second.bytes -= bytes;
  --load->second.calls[static_cast<std::size_t>(kind_of(lane))];
  if (load->second.calls == decltype(Load::calls){}) callers_.erase(load);
}

bool Gateway::tells_of(const std::string& call) {
  const auto now = std::chrono::steady_clock::now();
  const MutexLock lock(mutex_);
  std::erase_if(told_of_, [&](const auto& told) { return told.second + kTold <= now; });
  return told_of_.size() < kMaxTold && told_of_.emplace(call, now).second;
}

Call::Call(Gateway& gateway, grpc::CallbackServerContext* context, const char* method, Lane lane)
    : gateway_(gateway),
      context_(context),
      method_(method),
      lane_(lane),
      request_{choose_request_id(*context), traceparent_of(*context)},
      deadline_{deadline_of(*context, lane, gateway.limits_.default_deadline_s), [this]() -> Status {
                  if (gateway_.draining_) return {Reason::SHUTTING_DOWN, "the daemon is stopping"};
                  if (cancelled_) return {Reason::DEADLINE, "the caller has gone"};
                  return check_caller();
                }} {
  context_->AddInitialMetadata("x-request-id", request_.request_id);
  if (!request_.traceparent.empty()) context_->AddInitialMetadata("traceparent", request_.traceparent);
}

Call::~Call() {
  leave();
  if (!counted_) return;
  if (!known_peer_.empty()) gateway_.connections_.call_ends(known_peer_);
  gateway_.forget(this);
  --gateway_.calls_;
}

// A watcher may take messages as slowly as he likes, but must take the end of his stream.
Status Call::stalled(std::chrono::steady_clock::time_point now) const {
  const std::int64_t since = writing_since_;
  if (since == 0) return {};
  const std::chrono::duration<double> waited = now.time_since_epoch() - std::chrono::steady_clock::duration(since);
  if (lane_ == Lane::kWatches) {
    if (waited < kLeaves) return {};
    const Status over = deadline_.check();
    return over.ok() ? over : Status(over.reason(), "it takes no message, although " + over.message());
  }
  if (waited.count() <= gateway_.limits_.stalled_s) return {};
  char text[64];
  std::snprintf(text, sizeof text, "it has taken no message for %g s", gateway_.limits_.stalled_s);
  return {Reason::DEADLINE, text};
}

// Wakes it if its time has come.
void Call::look(std::chrono::steady_clock::time_point now) {
  if (sleep_ != Sleep::kAsleep) return;
  if (now.time_since_epoch().count() >= wake_at_ || !deadline_.check().ok()) wake();
}

void Call::wait(std::chrono::steady_clock::time_point until) {
  wake_at_ = until.time_since_epoch().count();
  auto awake = Sleep::kAwake;
  const bool at_once = until <= std::chrono::steady_clock::now();
  if (!at_once && sleep_.compare_exchange_strong(awake, Sleep::kAsleep)) return;
  sleep_ = Sleep::kAwake;
  post(resume_);
}

void Call::wake() {
  for (auto was = sleep_.load(); was != Sleep::kWoken;) {
    const auto next = was == Sleep::kAsleep ? Sleep::kAwake : Sleep::kWoken;
    if (!sleep_.compare_exchange_weak(was, next)) continue;
    if (was == Sleep::kAsleep) post(resume_);
    return;
  }
}

void Call::leave() {
  if (!running_) return;
  running_ = false;
  gateway_.leave(entered_as_, lane_, entered_bytes_);
  --gateway_.running_[static_cast<std::size_t>(Gateway::kind_of(lane_))];
  if (lane_ == Lane::kPictures) --gateway_.pictures_;
}

// Who calls, and whether they may, and may once more.
Status Call::admit_caller(std::size_t bytes) {
  auto caller = gateway_.gatekeeper_.identify(evidence_of(*context_, *context_->auth_context()));
  if (!caller.ok()) return caller.status();
  caller_ = std::move(*caller);
  request_.caller = caller_.name;
  request_.role = access::role_name(caller_.role);
  known_peer_ = context_->peer();
  gateway_.connections_.call_begins(known_peer_);
  if (Status may = check_role(caller_); !may.ok()) return may;
  entered_as_ = counted_as(caller_, context_->peer());
  entered_ = true;
  entered_bytes_ = Gateway::lasts(Gateway::kind_of(lane_)) ? 0 : bytes;
  return gateway_.enter(entered_as_, lane_, entered_bytes_);
}

Status Call::admit(std::size_t more) {
  counted_ = true;
  ++gateway_.calls_;
  {
    const MutexLock lock(gateway_.mutex_);
    gateway_.open_.insert(this);
  }
  const std::size_t bytes = kBytesPerCall + more;
  const Status may = admit_caller(bytes);
  if (!entered_) return may;
  running_ = true;
  const Gateway::Kind kind = Gateway::kind_of(lane_);
  const Gateway::Limit limit = gateway_.limit_of(kind);
  const int running = ++gateway_.running_[static_cast<std::size_t>(kind)];
  const int pictures = lane_ == Lane::kPictures ? ++gateway_.pictures_ : 0;
  if (!may.ok()) return may;
  if (gateway_.draining_) return {Reason::SHUTTING_DOWN, "the daemon is stopping"};
  if (running > limit.all)
    return {Reason::BUDGET_EXCEEDED, std::to_string(limit.all) + " " + limit.what + " " + limit.state + " already"};
  if (pictures > gateway_.limits_.max_pictures)
    return {Reason::BUDGET_EXCEEDED, std::to_string(gateway_.limits_.max_pictures) + " pictures are waiting already"};
  // Streams, and pictures that wait, must leave room for the replies of other calls.
  const std::size_t share = gateway_.budget_.allowance(storage::Share::kReplies);
  const auto too_much = [share](const char* what) {
    return Status(Reason::BUDGET_EXCEEDED, std::string(what) + " use half of the " + std::to_string(share) +
                                               " bytes that the memory budget leaves for replies");
  };
  if (Gateway::lasts(kind) && static_cast<std::size_t>(running) * bytes > share / 2)
    return too_much(kind == Gateway::Kind::kWatch ? "open watches" : "open streams of keyframes");
  charge_.emplace(gateway_.budget_, storage::Share::kReplies);
  if (Status status = charge_->grow_to(kBytesPerCall); !status.ok()) return status;
  // The picture that is being described has reserved memory; those that wait behind it do not.
  if (pictures == 1) return {};
  if (pictures > 1 && gateway_.budget_.used(storage::Share::kReplies) + more > share / 2)
    return too_much("waiting pictures");
  return charge_->grow_to(bytes);
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

void Call::post(std::function<void()> task) { gateway_.threads_of(lane_).post(std::move(task)); }

void Call::asks(const google::protobuf::Message& request) {
  if (!gateway_.audit_ || !is_audited(method_)) return;
  asked_ = AuditLog::text_of(request);
  const google::protobuf::FieldDescriptor* token = request.GetDescriptor()->FindFieldByName("page_token");
  goes_on_ = token && !request.GetReflection()->GetString(request, token).empty();
}

grpc::Status Call::end(const Status& status) {
  const RequestScope scope(request_);
  leave();
  writing();
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - begun_);
  gateway_.metrics_.count(method_, status.reason(), std::chrono::duration<double>(took).count());
  if (status.reason() == Reason::INTERNAL || status.reason() == Reason::IO_ERROR ||
      status.reason() == Reason::DATA_LOSS)
    spdlog::error("{} from {}: {}", method_, context_->peer(), status.to_string());
  else if ((status.reason() == Reason::NOT_ALLOWED || status.reason() == Reason::UNAUTHENTICATED) &&
           gateway_.tells_of(counted_as(caller_, context_->peer()) + " " + method_))
    spdlog::warn("{} from {}: {}", method_, context_->peer(), status.to_string());
  else
    spdlog::debug("{} from {}: {} in {} us", method_, context_->peer(), status.to_string(), took.count());
  // Of a list that is read page by page, the first page is told, so that reading the audit log does not fill it.
  if (gateway_.audit_ && is_audited(method_) && !(goes_on_ && status.ok())) {
    AuditLog::Entry entry;
    entry.who = caller_.name;
    entry.role = std::string(access::role_name(caller_.role));
    entry.from = context_->peer();
    entry.method = method_;
    entry.request = asked_;
    entry.request_id = request_.request_id;
    entry.trace_id = request_.trace_id();
    entry.outcome = status;
    entry.took = took;
    gateway_.audit_->write(entry);
  }
  return to_grpc(status, request_.request_id);
}

}  // namespace relmap::rpc
