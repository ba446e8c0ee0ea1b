// One robot's stream of keyframes (Ingest.Stream). Keyframes go to the intake, and the intake's acknowledgements and
// news of the robot's sessions go back. A message is read only when the one before has been processed, so gRPC's flow
// control limits a fast sender. Only the newest acknowledgement of a session is kept for sending, so a slow receiver
// takes no memory.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "proto/base/mutex.h"
#include "relmap/v1/ingest.pb.h"
#include "server/rpc/core.h"
#include "server/rpc/gateway.h"

namespace relmap::rpc {

class IngestStream final : public grpc::ServerBidiReactor<v1::IngestRequest, v1::IngestReply> {
 public:
  // The object deletes itself when the stream is done.
  IngestStream(map::Mapper& mapper, const Intake& intake, Gateway& gateway, grpc::CallbackServerContext* context);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // By which the intake finds the stream when it has taken a message, unless the stream has gone.
  struct Self {
    Mutex mutex;
    IngestStream* stream RELMAP_GUARDED_BY(mutex);
  };

  Status take(const v1::IngestRequest& request);
  Status begin(const v1::IngestRequest& request);
  Status join(const SessionUuid& session);
  intake::IngestServer::Taken then_go_on(const SessionUuid& session);
  void leave(const SessionUuid& session);
  void read_next();
  void hear(const Acknowledgement& ack, const std::string& robot);
  void hear(const PoseNews& news, const std::string& robot);
  bool may_hear(const SessionUuid& session, const std::string& robot) RELMAP_REQUIRES(mutex_);
  bool is_for_us(const SessionUuid& session, const std::string& robot) const RELMAP_REQUIRES(mutex_);
  void end(const Status& status);
  void go_on() RELMAP_REQUIRES(mutex_);

  map::Mapper& mapper_;
  intake::IngestServer* const intake_;  // null: refused
  Call call_;
  const std::shared_ptr<Self> self_;
  v1::IngestRequest request_;
  std::string who_;  // robot and address, set by its hello

  Mutex mutex_;
  std::set<SessionUuid> sessions_ RELMAP_GUARDED_BY(mutex_);  // sessions that this stream has mentioned
  std::map<SessionUuid, Acknowledgement> acknowledgements_ RELMAP_GUARDED_BY(mutex_);
  std::deque<v1::IngestReply> replies_ RELMAP_GUARDED_BY(mutex_);
  v1::IngestReply writing_ RELMAP_GUARDED_BY(mutex_);
  bool write_under_way_ RELMAP_GUARDED_BY(mutex_) = false;
  std::optional<Status> ending_ RELMAP_GUARDED_BY(mutex_);
  bool finished_ RELMAP_GUARDED_BY(mutex_) = false;

  std::unique_ptr<intake::IngestServer::Subscription> subscription_;  // declared last, so that it is destroyed first
};

}  // namespace relmap::rpc
