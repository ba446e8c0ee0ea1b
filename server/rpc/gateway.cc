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

Gateway::Gateway(const RpcLimits& limits, storage::Budget& budget, Metrics& metrics, const Gatekeeper& gatekeeper)
    : limits_(limits),
      budget_(budget),
      metrics_(metrics),
      gatekeeper_(gatekeeper),
      general_(limits.threads),
      picture_thread_(1),
      maintenance_thread_(1) {}

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
  if (counted_) --gateway_.calls_;
}

void Call::leave() {
  if (!running_) return;
  running_ = false;
  if (lane_ == Lane::kIngest) {
    --gateway_.ingest_;
    return;
  }
  --gateway_.running_;
  if (lane_ == Lane::kPictures) --gateway_.pictures_;
}

Status Call::admit(std::size_t more) {
  auto caller = identify();
  if (!caller.ok()) return caller.status();
  caller_ = std::move(*caller);
  counted_ = running_ = true;
  ++gateway_.calls_;
  if (lane_ == Lane::kIngest) {
    const int streams = ++gateway_.ingest_;
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
  const int running = ++gateway_.running_;
  const int pictures = lane_ == Lane::kPictures ? ++gateway_.pictures_ : 0;
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

Result<Identity> Call::identify() const {
  auto caller = gateway_.gatekeeper_.identify(evidence_of(*context_, *context_->auth_context()));
  if (!caller.ok()) return caller;
  const auto required = required_role(method_);
  if (!required || caller->role < *required)
    return Status(Reason::NOT_ALLOWED, std::string(method_) + " is for the role " +
                                           std::string(access::role_name(required.value_or(Role::kOperator))) +
                                           ", and " + caller->name + " has the role " +
                                           std::string(access::role_name(caller->role)));
  return caller;
}

Status Call::check_caller() const {
  if (gateway_.gatekeeper_.is_current(caller_)) return {};
  const auto now = identify();
  if (!now.ok()) return now.status();
  return now->name == caller_.name && now->role == caller_.role
             ? Status()
             : Status(Reason::UNAUTHENTICATED, "the credentials of " + caller_.name + " have changed");
}

void Call::post(std::function<void()> task) {
  TaskPool& pool = lane_ == Lane::kPictures      ? gateway_.picture_thread_
                   : lane_ == Lane::kMaintenance ? gateway_.maintenance_thread_
                                                 : gateway_.general_;
  pool.post(std::move(task));
}

grpc::Status Call::end(const Status& status) {
  leave();
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - begun_);
  gateway_.metrics_.count(method_, status.reason(), took);
  if (status.reason() == Reason::INTERNAL || status.reason() == Reason::IO_ERROR ||
      status.reason() == Reason::DATA_LOSS)
    spdlog::error("{} [{}] from {}: {}", method_, request_id_, context_->peer(), status.to_string());
  else
    spdlog::debug("{} [{}] from {}: {} in {} us", method_, request_id_, context_->peer(), status.to_string(),
                  took.count());
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
