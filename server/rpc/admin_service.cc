#include "relmap/v1/admin.grpc.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/services.h"

namespace relmap::rpc {

namespace {

class AdminService final : public v1::Admin::CallbackService {
 public:
  AdminService(Core& core, Gateway& gateway) : core_(core), gateway_(gateway) {}

  Unary* WaitIdle(Context* context, const v1::WaitIdleRequest* request, v1::WaitIdleReply* reply) override {
    return unary(context, "Admin.WaitIdle", request, reply, wait_idle, Lane::kWaits);
  }
  Stream<v1::VerifyReply>* Verify(Context* context, const v1::VerifyRequest* request) override {
    return stream<v1::VerifyReply>(context, "Admin.Verify", request, verify_request);
  }
  Stream<v1::VerifyReply>* Repair(Context* context, const v1::RepairRequest* request) override {
    return stream<v1::VerifyReply>(context, "Admin.Repair", request, repair_request);
  }
  Stream<v1::Progress>* Backup(Context* context, const v1::BackupRequest* request) override {
    return stream<v1::Progress>(context, "Admin.Backup", request, backup);
  }
  Stream<v1::Progress>* Compact(Context* context, const v1::CompactRequest* request) override {
    return stream<v1::Progress>(context, "Admin.Compact", request, compact);
  }
  Stream<v1::Progress>* Reindex(Context* context, const v1::ReindexRequest* request) override {
    return stream<v1::Progress>(context, "Admin.Reindex", request, reindex_request);
  }
  Unary* GetStats(Context* context, const v1::GetStatsRequest* request, v1::GetStatsReply* reply) override {
    return unary(context, "Admin.GetStats", request, reply, get_stats);
  }
  Unary* Commit(Context* context, const v1::CommitRequest* request, v1::CommitReply* reply) override {
    return unary(context, "Admin.Commit", request, reply, commit, Lane::kEdits);
  }
  Unary* SetLogLevel(Context* context, const v1::SetLogLevelRequest* request, v1::SetLogLevelReply* reply) override {
    return unary(context, "Admin.SetLogLevel", request, reply, change_log_level);
  }
  Unary* FreezeSession(Context* context, const v1::FreezeSessionRequest* request,
                       v1::FreezeSessionReply* reply) override {
    return unary(context, "Admin.FreezeSession", request, reply, freeze_session, Lane::kEdits);
  }
  Stream<v1::Progress>* DeleteSession(Context* context, const v1::DeleteSessionRequest* request) override {
    return stream<v1::Progress>(context, "Admin.DeleteSession", request, delete_session, Lane::kEdits);
  }
  // Reads files, so it holds up no question.
  Unary* ListAudit(Context* context, const v1::ListAuditRequest* request, v1::ListAuditReply* reply) override {
    return unary(context, "Admin.ListAudit", request, reply, list_audit, Lane::kMaintenance);
  }

 private:
  template <typename Request, typename Reply, typename... Parts>
  Unary* unary(Context* context, const char* method, const Request* request, Reply* reply,
               Result<Reply> (*handler)(const Request&, const Deadline&, Parts...), Lane lane = Lane::kGeneral) {
    return gateway_.unary(context, method, lane, request, reply,
                          [this, handler](const Request& r, const Deadline& d) { return call(core_, handler, r, d); });
  }
  template <typename Reply, typename Request, typename... Parts>
  Stream<Reply>* stream(Context* context, const char* method, const Request* request,
                        Result<Producer<Reply>> (*handler)(const Request&, const Deadline&, Parts...),
                        Lane lane = Lane::kMaintenance) {
    return gateway_.stream<Reply>(context, method, lane, request, [this, handler](const Request& r, const Deadline& d) {
      return call(core_, handler, r, d);
    });
  }

  Core& core_;
  Gateway& gateway_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_admin_service(Core& core, Gateway& gateway) {
  return std::make_unique<AdminService>(core, gateway);
}

}  // namespace relmap::rpc
