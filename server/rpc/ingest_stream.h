// One robot's stream of keyframes (Ingest.Stream): what it sends goes to the intake, what the intake says of its
// sessions goes back. A message is read when the one before has been taken in, so gRPC's flow control holds a sender
// back; of acknowledgements only the newest waits, so a slow receiver holds nothing.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "relmap/v1/ingest.pb.h"
#include "server/rpc/core.h"
#include "server/rpc/gateway.h"

namespace relmap::rpc {

class IngestStream final : public grpc::ServerBidiReactor<v1::IngestRequest, v1::IngestReply> {
 public:
  // Deletes itself when the stream is done.
  IngestStream(map::Mapper& mapper, const Intake& intake, Gateway& gateway, grpc::CallbackServerContext* context);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  Status take(v1::IngestRequest& request);
  Status begin(const v1::IngestRequest& request);
  Status join(const SessionUuid& session);
  void hear(const Acknowledgement& ack);
  void hear(const PoseNews& news);
  void end(const Status& status);
  void go_on();  // mutex_ is held

  map::Mapper& mapper_;
  intake::IngestServer* const intake_;  // null: refused
  Call call_;
  v1::IngestRequest request_;
  std::string who_;  // robot and address, once it has said hello

  std::mutex mutex_;
  std::set<SessionUuid> sessions_;  // that were spoken of here
  std::map<SessionUuid, Acknowledgement> acknowledgements_;
  std::deque<v1::IngestReply> replies_;
  v1::IngestReply writing_;
  bool write_under_way_ = false;
  std::optional<Status> ending_;
  bool finished_ = false;

  std::unique_ptr<intake::IngestServer::Subscription> subscription_;  // destroyed first
};

}  // namespace relmap::rpc
