// A fake Ingest service for tests: a daemon that settles at once what it gets, and can be told to misbehave. What it
// has settled survives its restarts.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "proto/base/hex.h"
#include "proto/keyframe/ingest_messages.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "relmap/v1/ingest.grpc.pb.h"

namespace relmap::publishing {

class FakeIngest final : public v1::Ingest::Service {
 public:
  using Both = grpc::ServerReaderWriter<v1::IngestReply, v1::IngestRequest>;

  // How it behaves. Set between calls, or under lock().
  struct Manners {
    std::uint32_t credits = 8;
    bool silent = false;   // never answers
    int breaks = 0;        // breaks so many more streams,
    int break_after = 5;   // each after that many keyframes
    grpc::Status refusal;  // refuses every stream if not ok
    int protocol = kProtocolMajor;
    MapIdentity map;                       // the map that it introduces itself with; none if not known
    std::set<std::uint32_t> refused;       // refuses these sequences (NOT_FINITE)
    std::vector<v1::IngestReply> between;  // sent before each acknowledgement
    int deaf_to_ends = 0;                  // ignores so many ends of sessions
  };

  ~FakeIngest() override { stop(); }

  void start(std::uint8_t boot) {
    boot_ = {boot};
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  void stop() {
    if (!server_) return;
    server_->Shutdown(std::chrono::system_clock::now());
    server_.reset();
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  std::string boot_text() const { return hex(boot_); }

  std::unique_lock<std::mutex> lock() { return std::unique_lock(mutex_); }
  Manners manners;

  // Under lock().
  std::map<std::uint32_t, std::uint32_t> settled;  // sequence -> CRC, 0 for a gap
  std::vector<std::uint32_t> order;                // sequences of keyframes as they arrived
  std::vector<std::string> robots;                 // of each accepted stream
  std::uint64_t beyond_credits = 0;                // keyframes
  std::uint64_t bad_payloads = 0;
  std::vector<std::uint64_t> ends;  // next_sequence of each end that arrived

  grpc::Status Stream(grpc::ServerContext* context, Both* stream) override {
    v1::IngestRequest request;
    if (is_silent()) {
      while (!context->IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      return grpc::Status::CANCELLED;
    }
    if (!stream->Read(&request) || !request.has_hello()) return {grpc::StatusCode::INVALID_ARGUMENT, "no hello"};
    {
      const auto held = lock();
      if (!manners.refusal.ok()) return manners.refusal;
      robots.push_back(request.hello().robot());
    }
    v1::IngestReply reply;
    reply.mutable_welcome()->mutable_protocol()->set_major(manners.protocol);
    reply.mutable_welcome()->set_boot_id(boot_.data(), boot_.size());
    if (const auto held = lock(); manners.map.known()) {
      reply.mutable_welcome()->set_map_uuid(uuid_to_wire(manners.map.uuid));
      reply.mutable_welcome()->set_map_epoch(manners.map.epoch);
    }
    stream->Write(reply);
    for (int keyframes = 0; stream->Read(&request);) {
      const auto held = lock();
      keyframes += request.has_keyframe();
      if (manners.breaks > 0 && keyframes > manners.break_after) {
        --manners.breaks;
        return {grpc::StatusCode::UNAVAILABLE, "broken off"};
      }
      for (const v1::IngestReply& said : manners.between) stream->Write(said);
      take(request, *stream);
    }
    return grpc::Status::OK;
  }

 private:
  bool is_silent() {
    const auto held = lock();
    return manners.silent;
  }

  std::uint64_t next_sequence() const {
    std::uint64_t next = 0;
    while (settled.contains(static_cast<std::uint32_t>(next))) ++next;
    return next;
  }

  void take(const v1::IngestRequest& request, Both& stream) {
    if (request.has_end()) {
      ends.push_back(request.end().next_sequence());
      if (static_cast<int>(ends.size()) <= manners.deaf_to_ends) return;
      v1::IngestReply reply;
      *reply.mutable_ended() = request.end();
      stream.Write(reply);
      return;
    }
    v1::IngestReply reply;
    v1::Acknowledgement& ack = *reply.mutable_acknowledgement();
    if (request.has_gap()) {
      for (std::uint32_t s = request.gap().first(); s <= request.gap().last(); ++s) settled.try_emplace(s, 0);
      ack.set_session_uuid(request.gap().session_uuid());
    } else {
      const v1::KeyframePayload& keyframe = request.keyframe();
      ack.set_session_uuid(keyframe.session_uuid());
      order.push_back(keyframe.sequence());
      beyond_credits += keyframe.sequence() >= next_sequence() + manners.credits;
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(keyframe.payload().data());
      const auto decoded = decode_keyframe(ByteSpan(bytes, keyframe.payload().size()));
      bad_payloads += !decoded.ok() || decoded->sequence != keyframe.sequence();
      const auto [it, fresh] = settled.try_emplace(keyframe.sequence(), keyframe.crc32c());
      const bool conflict = !fresh && it->second != keyframe.crc32c();
      if (conflict || manners.refused.contains(keyframe.sequence())) {
        v1::Refusal& refusal = *ack.add_refused();
        refusal.set_sequence(keyframe.sequence());
        refusal.set_crc32c(keyframe.crc32c());
        refusal.set_reason(to_wire(conflict ? Reason::SEQUENCE_CONFLICT : Reason::NOT_FINITE));
      }
    }
    ack.set_boot_id(boot_.data(), boot_.size());
    ack.set_next_sequence(next_sequence());
    ack.set_credits(manners.credits);
    stream.Write(reply);
  }

  std::mutex mutex_;
  BootId boot_{};
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace relmap::publishing
