#include "relmap/v1/ingest.grpc.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/ingest_stream.h"
#include "server/rpc/services.h"

namespace relmap::rpc {

namespace {

class IngestService final : public v1::Ingest::CallbackService {
 public:
  IngestService(Core& core, Gateway& gateway) : core_(core), gateway_(gateway) {}

  grpc::ServerBidiReactor<v1::IngestRequest, v1::IngestReply>* Stream(grpc::CallbackServerContext* context) override {
    return new IngestStream(core_.mapper, core_.intake, gateway_, context);
  }

  grpc::ServerUnaryReactor* GetAcknowledgement(grpc::CallbackServerContext* context,
                                               const v1::GetAcknowledgementRequest* request,
                                               v1::Acknowledgement* reply) override {
    return gateway_.unary(context, "Ingest.GetAcknowledgement", Lane::kGeneral, request, reply,
                          [this](const v1::GetAcknowledgementRequest& r, const Deadline& d) {
                            return call(core_, get_acknowledgement, r, d);
                          });
  }

 private:
  Core& core_;
  Gateway& gateway_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_ingest_service(Core& core, Gateway& gateway) {
  return std::make_unique<IngestService>(core, gateway);
}

}  // namespace relmap::rpc
