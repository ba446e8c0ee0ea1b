#include "relmap/v1/admin.grpc.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/services.h"
#include "server/rpc/unimplemented.h"

namespace relmap {

namespace {

using Context = grpc::CallbackServerContext;
using Unary = grpc::ServerUnaryReactor;
template <typename Reply>
using Stream = grpc::ServerWriteReactor<Reply>;

class AdminService final : public v1::Admin::CallbackService {
 public:
  AdminService(Core& core, Gateway& gateway) : core_(core), gateway_(gateway) {}

  Unary* WaitIdle(Context* context, const v1::WaitIdleRequest* request, v1::WaitIdleReply* reply) override {
    return gateway_.unary(context, "Admin.WaitIdle", Lane::kGeneral, request, reply,
                          [this](const auto& r, const Deadline& d) { return wait_idle(core_, r, d); });
  }

  Stream<v1::VerifyReply>* Verify(Context* context, const v1::VerifyRequest* request) override {
    return unimplemented_stream<v1::VerifyReply>(gateway_, context, "Admin.Verify", request);
  }
  Stream<v1::VerifyReply>* Repair(Context* context, const v1::RepairRequest* request) override {
    return unimplemented_stream<v1::VerifyReply>(gateway_, context, "Admin.Repair", request);
  }
  Stream<v1::Progress>* Backup(Context* context, const v1::BackupRequest* request) override {
    return unimplemented_stream<v1::Progress>(gateway_, context, "Admin.Backup", request);
  }
  Stream<v1::Progress>* Compact(Context* context, const v1::CompactRequest* request) override {
    return unimplemented_stream<v1::Progress>(gateway_, context, "Admin.Compact", request);
  }
  Stream<v1::Progress>* Reindex(Context* context, const v1::ReindexRequest* request) override {
    return unimplemented_stream<v1::Progress>(gateway_, context, "Admin.Reindex", request);
  }
  Unary* GetStats(Context* context, const v1::GetStatsRequest* request, v1::GetStatsReply* reply) override {
    return unimplemented_unary(gateway_, context, "Admin.GetStats", request, reply);
  }
  Unary* Commit(Context* context, const v1::CommitRequest* request, v1::CommitReply* reply) override {
    return unimplemented_unary(gateway_, context, "Admin.Commit", request, reply);
  }
  Stream<v1::Progress>* DeleteSession(Context* context, const v1::DeleteSessionRequest* request) override {
    return unimplemented_stream<v1::Progress>(gateway_, context, "Admin.DeleteSession", request);
  }

 private:
  Core& core_;
  Gateway& gateway_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_admin_service(Core& core, Gateway& gateway) {
  return std::make_unique<AdminService>(core, gateway);
}

}  // namespace relmap
