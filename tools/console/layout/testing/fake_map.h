// A daemon of which a test decides what it says: a straight drive, and whose calls it refuses.
#pragma once

#include <grpcpp/grpcpp.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "client/relmap_client.h"
#include "proto/base/mutex.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.grpc.pb.h"

namespace relmap::console::testing {

struct FakeState {
  std::string boot_id = "boot";
  MapIdentity map{Uuid::random(), 1};
  std::uint64_t map_version = 1;
  std::uint32_t frames = 20;  // that the status tells
  std::uint32_t drawn = 20;   // of them in metres
  // What calls of those are answered with whose connection has this name.
  std::map<std::string, Reason> refused = {};
};

// Serves at a Unix socket while it lives.
class FakeMap final : public v1::Map::Service {
 public:
  FakeMap() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("unix:" + socket_, grpc::InsecureServerCredentials());
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
    if (!server_) throw std::runtime_error("cannot listen at " + socket_);
  }
  ~FakeMap() override {
    server_->Shutdown();
    std::error_code ignored;
    std::filesystem::remove(socket_, ignored);
  }

  // A connection whose calls have this name, as it would have the token of somebody.
  Result<std::unique_ptr<client::Client>> connect(const std::string& name = "") {
    {
      const MutexLock lock(mutex_);
      ++connections_;
    }
    client::ClientOptions options;
    options.request_id = name;
    return client::Client::connect("unix:" + socket_, std::move(options));
  }

  void change(const std::function<void(FakeState&)>& how) {
    const MutexLock lock(mutex_);
    how(state_);
  }
  // Called when somebody asks for a skeleton, before it is told.
  void before_skeleton(std::function<void(FakeState&)> what) {
    const MutexLock lock(mutex_);
    before_skeleton_ = std::move(what);
  }
  FakeState state() const {
    const MutexLock lock(mutex_);
    return state_;
  }
  int connections() const {
    const MutexLock lock(mutex_);
    return connections_;
  }
  int statuses() const {
    const MutexLock lock(mutex_);
    return statuses_;
  }
  int skeletons() const {
    const MutexLock lock(mutex_);
    return skeletons_;
  }

  grpc::Status GetStatus(grpc::ServerContext* context, const v1::GetStatusRequest*,
                         v1::GetStatusReply* reply) override {
    const MutexLock lock(mutex_);
    ++statuses_;
    if (grpc::Status judged = judge(*context); !judged.ok()) return judged;
    reply->set_boot_id(state_.boot_id);
    reply->set_map_uuid(state_.map.uuid.to_string());
    reply->set_map_epoch(state_.map.epoch);
    reply->set_map_version(state_.map_version);
    reply->set_frames(state_.frames);
    return grpc::Status::OK;
  }

  grpc::Status GetSkeleton(grpc::ServerContext* context, const v1::GetSkeletonRequest*,
                           grpc::ServerWriter<v1::GetSkeletonReply>* writer) override {
    v1::GetSkeletonReply reply;
    {
      const MutexLock lock(mutex_);
      ++skeletons_;
      if (grpc::Status judged = judge(*context); !judged.ok()) return judged;
      if (before_skeleton_) before_skeleton_(state_);
      reply.set_map_version(state_.map_version);
      reply.set_commit_number(state_.map_version);
      reply.set_frames_done(state_.drawn);
      reply.set_frames_total(state_.drawn);
      if (state_.drawn > 0) tell_drive(state_.drawn, *reply.add_chains());
    }
    writer->Write(reply);
    return grpc::Status::OK;
  }

 private:
  static void tell_drive(std::uint32_t frames, v1::SkeletonChain& chain) {
    chain.set_session(1);
    for (std::uint32_t k = 0; k < frames; ++k) {
      chain.add_index(k == 0 ? 0 : 1);
      chain.add_time_ms(k == 0 ? 1'700'000'000'000 : 100);
      if (k == 0) continue;
      for (const float number : {0.f, 0.f, 1.f, 0.f, 0.f, 0.f}) chain.add_step(number);
      for (const float number : {1e-4f, 1e-6f}) chain.add_variance(number);
      chain.add_frames(1);
    }
  }
  grpc::Status judge(const grpc::ServerContext& context) const RELMAP_REQUIRES(mutex_) {
    const auto name = context.client_metadata().find("x-request-id");
    if (name == context.client_metadata().end()) return grpc::Status::OK;
    const auto refused = state_.refused.find(std::string(name->second.data(), name->second.size()));
    if (refused == state_.refused.end()) return grpc::Status::OK;
    v1::Error error;
    error.set_reason(to_wire(refused->second));
    error.set_message("refused");
    return {grpc::StatusCode::PERMISSION_DENIED, "refused", error.SerializeAsString()};
  }

  const std::string socket_ =
      (std::filesystem::temp_directory_path() / ("relmap-fake-map-" + Uuid::random().to_string())).string();
  mutable Mutex mutex_;
  FakeState state_ RELMAP_GUARDED_BY(mutex_);
  std::function<void(FakeState&)> before_skeleton_ RELMAP_GUARDED_BY(mutex_);
  int connections_ RELMAP_GUARDED_BY(mutex_) = 0, statuses_ RELMAP_GUARDED_BY(mutex_) = 0,
                   skeletons_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace relmap::console::testing
