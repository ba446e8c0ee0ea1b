#include "relmap/v1/ingest.grpc.pb.h"
#include "server/rpc/services.h"
#include "server/rpc/unimplemented.h"

namespace relmap {

namespace {

class IngestService final : public v1::Ingest::CallbackService {
 public:
  explicit IngestService(Gateway& gateway) : gateway_(gateway) {}

  grpc::ServerBidiReactor<v1::IngestRequest, v1::IngestReply>* Stream(grpc::CallbackServerContext* context) override {
    class Reactor final : public grpc::ServerBidiReactor<v1::IngestRequest, v1::IngestReply> {
     public:
      Reactor(Gateway& gateway, grpc::CallbackServerContext* c) : call_(gateway, c, "Ingest.Stream", Lane::kGeneral) {
        const Status admitted = call_.admit(0);
        Finish(call_.end(admitted.ok() ? unimplemented("Ingest.Stream") : admitted));
      }
      void OnDone() override { delete this; }

     private:
      Call call_;
    };
    return new Reactor(gateway_, context);
  }

  grpc::ServerUnaryReactor* GetAcknowledgement(grpc::CallbackServerContext* context,
                                               const v1::GetAcknowledgementRequest* request,
                                               v1::Acknowledgement* reply) override {
    return unimplemented_unary(gateway_, context, "Ingest.GetAcknowledgement", request, reply);
  }

 private:
  Gateway& gateway_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_ingest_service(Gateway& gateway) {
  return std::make_unique<IngestService>(gateway);
}

}  // namespace relmap
