#include "server/rpc/server.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <thread>

#include "proto/wire/convert.h"
#include "relmap/v1/admin.grpc.pb.h"
#include "relmap/v1/ingest.grpc.pb.h"
#include "relmap/v1/map.grpc.pb.h"
#include "server/rpc/error_mapping.h"
#include "server/rpc/roles.h"
#include "server/rpc/testing/served_map.h"

namespace relmap::rpc {
namespace {

v1::Error error_of(const grpc::Status& status) {
  v1::Error error;
  EXPECT_TRUE(error.ParseFromString(status.error_details()));
  return error;
}

// No test lives to see its end: where stop() waited for its deadline, it would not return.
constexpr std::chrono::hours kStopPatience{24 * 365};

class Server : public testing::Test {
 protected:
  Server() {
    server_ = RpcServer::start(*map_.core, everyone_, {.host = "127.0.0.1"}).or_throw();
    address_ = "127.0.0.1:" + std::to_string(server_->port());
    channel_ = grpc::CreateChannel(address_, grpc::InsecureChannelCredentials());
    map_stub_ = v1::Map::NewStub(channel_);
  }
  std::unique_ptr<grpc::ClientContext> context(int within_s = 20) {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(within_s));
    return context;
  }
  grpc::Status get_frame(FrameId id, v1::GetFrameReply* reply, grpc::ClientContext* in = nullptr) {
    const auto own = context();
    v1::GetFrameRequest request;
    request.mutable_frame()->set_session(id.session);
    request.mutable_frame()->set_index(id.index);
    return map_stub_->GetFrame(in ? in : own.get(), request, reply);
  }
  // Makes a call by name and bytes, for services for whose messages we have no code.
  Result<std::string> call_raw(const std::string& method, const std::string& bytes) {
    grpc::GenericStub stub(channel_);
    grpc::CompletionQueue queue;
    const auto call_context = context();
    const grpc::Slice slice(bytes);
    const auto call = stub.PrepareUnaryCall(call_context.get(), method, grpc::ByteBuffer(&slice, 1), &queue);
    grpc::ByteBuffer reply;
    grpc::Status status;
    call->StartCall();
    call->Finish(&reply, &status, this);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    if (!status.ok()) return {Reason::UNREACHABLE, status.error_message()};
    std::vector<grpc::Slice> slices;
    EXPECT_TRUE(reply.Dump(&slices).ok());
    std::string text;
    for (const grpc::Slice& part : slices) text.append(reinterpret_cast<const char*>(part.begin()), part.size());
    return text;
  }

  ServedMap map_;
  const Gatekeeper everyone_{"", true};
  std::unique_ptr<RpcServer> server_;
  std::string address_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::Map::Stub> map_stub_;
};

TEST_F(Server, AnswersQuestions) {
  v1::GetFrameReply reply;
  const grpc::Status status = get_frame({1, 3}, &reply);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(reply.frame().id().index(), 3u);
}

TEST_F(Server, RefusalsCarryTheirReasonAndTheRequestId) {
  const auto call = context();
  call->AddMetadata("x-request-id", "robot-7.42");
  v1::GetFrameReply reply;
  const grpc::Status status = get_frame({1, 4000}, &reply, call.get());
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  const v1::Error error = error_of(status);
  EXPECT_EQ(error.reason(), v1::REASON_NO_SUCH_FRAME);
  EXPECT_EQ(error.message(), "no frame 1:4000");
  EXPECT_EQ(error.request_id(), "robot-7.42");
  EXPECT_EQ(call->GetServerInitialMetadata().find("x-request-id")->second, "robot-7.42");
}

TEST_F(Server, ARequestIdThatIsUnfitForTheLogIsReplaced) {
  const auto call = context();
  call->AddMetadata("x-request-id", "two words");
  v1::GetFrameReply reply;
  EXPECT_NE(error_of(get_frame({9, 9}, &reply, call.get())).request_id(), "two words");
}

TEST_F(Server, StreamsARoute) {
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = to_wire(ServedMap::kFirst);
  *request.mutable_to()->mutable_frame() = to_wire(ServedMap::kLast);
  const auto call = context();
  const auto reader = map_stub_->FindRoute(call.get(), request);
  v1::FindRouteReply reply;
  int steps = 0, total = 0;
  while (reader->Read(&reply)) {
    if (reply.has_summary()) total = static_cast<int>(reply.summary().steps());
    steps += reply.steps_size();
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_GT(steps, 1);
  EXPECT_EQ(steps, total);
}

TEST_F(Server, AStreamThatCannotBeginSaysWhy) {
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = to_wire(ServedMap::kFirst);
  *request.mutable_to()->mutable_frame() = to_wire(ServedMap::kUnconnected);
  const auto call = context();
  const auto reader = map_stub_->FindRoute(call.get(), request);
  v1::FindRouteReply reply;
  EXPECT_FALSE(reader->Read(&reply));
  const grpc::Status status = reader->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(error_of(status).reason(), v1::REASON_NOT_CONNECTED);
}

TEST_F(Server, AMapIsReindexedWithoutIt) {
  const auto call = context();
  const auto reader = v1::Admin::NewStub(channel_)->Reindex(call.get(), {});
  v1::Progress progress;
  EXPECT_FALSE(reader->Read(&progress));
  const grpc::Status status = reader->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(error_of(status).reason(), v1::REASON_FOLDER_LOCKED);
  EXPECT_THAT(error_of(status).message(), testing::HasSubstr("relmap-admin reindex"));
}

// gRPC itself would answer as if there were no such method.
TEST_F(Server, ARequestThatCannotBeReadIsRefusedByName) {
  v1::SetLabelRequest label;
  label.mutable_frame()->set_session(1);
  label.set_label("caf\xe9");
  v1::SetLabelReply labelled;
  const grpc::Status status = map_stub_->SetLabel(context().get(), label, &labelled);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(error_of(status).reason(), v1::REASON_INVALID_ARGUMENT);
  EXPECT_EQ(error_of(status).message(),
            "the request of Map.SetLabel cannot be read: its bytes are damaged, or a text is not UTF-8");
  // The same for a streaming RPC.
  v1::FindRouteRequest route;
  route.mutable_to()->set_label("\xff");
  const auto asked = context();
  const auto stream = map_stub_->FindRoute(asked.get(), route);
  v1::FindRouteReply step;
  EXPECT_FALSE(stream->Read(&step));
  EXPECT_EQ(error_of(stream->Finish()).reason(), v1::REASON_INVALID_ARGUMENT);
  EXPECT_THAT(call_raw("/relmap.v1.Map/GetFrame", "\xff\xff").status().message(), testing::HasSubstr("Map.GetFrame"));
  EXPECT_EQ(call_raw("/relmap.v1.Map/NoSuch", "").status().message(), "") << "that is another thing";
  EXPECT_EQ(call_raw("/other.Service/SetLabel", "\xff").status().message(), "");
  v1::GetFrameReply reply;
  EXPECT_TRUE(get_frame({1, 3}, &reply).ok());
}

TEST_F(Server, WithoutAnIntakeTakesNoKeyframes) {
  const auto streaming = context();
  const auto stream = v1::Ingest::NewStub(channel_)->Stream(streaming.get());
  v1::IngestReply reply;
  EXPECT_FALSE(stream->Read(&reply));
  EXPECT_EQ(error_of(stream->Finish()).reason(), v1::REASON_UNSUPPORTED);
}

TEST_F(Server, CountsItsCallsInStatus) {
  v1::GetFrameReply frame;
  EXPECT_TRUE(get_frame({1, 1}, &frame).ok());
  EXPECT_FALSE(get_frame({1, 999}, &frame).ok());
  v1::GetStatusReply status;
  ASSERT_TRUE(map_stub_->GetStatus(context().get(), {}, &status).ok());
  bool found = false;
  for (const v1::MethodCount& method : status.methods()) {
    if (method.method() != "Map.GetFrame") continue;
    found = true;
    EXPECT_EQ(method.calls(), 2u);
    EXPECT_EQ(method.failures(), 1u);
    EXPECT_EQ(method.failures_by_reason(0).reason(), v1::REASON_NO_SUCH_FRAME);
  }
  EXPECT_TRUE(found);
}

TEST_F(Server, ManyCallersAtOnceAreAllAnswered) {
  std::vector<std::thread> callers;
  std::atomic<int> answered = 0;
  for (int t = 0; t < 4; ++t)
    callers.emplace_back([&] {
      for (std::uint32_t i = 0; i < 50; ++i) {
        v1::GetFrameReply reply;
        answered += get_frame({1, i % ServedMap::kFrames}, &reply).ok();
      }
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(answered, 200);
}

TEST_F(Server, AnswersHealthAndReflection) {
  // grpc.health.v1.HealthCheckResponse{status: SERVING}
  EXPECT_EQ(call_raw("/grpc.health.v1.Health/Check", "").or_throw(), "\x08\x01");
  // ServerReflectionRequest{list_services: ""}
  const auto services =
      call_raw("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", std::string("\x3a\x00", 2));
  ASSERT_TRUE(services.ok()) << services.status().to_string();
  for (const char* name : {"relmap.v1.Map", "relmap.v1.Ingest", "relmap.v1.Admin", "grpc.health.v1.Health"})
    EXPECT_THAT(*services, testing::HasSubstr(name));
}

TEST_F(Server, HealthIsToldOfEachServiceAndGoesFirstInAStop) {
  const auto health_of = [&](const std::string& service) {
    return call_raw("/grpc.health.v1.Health/Check",
                    "\x0a" + std::string(1, static_cast<char>(service.size())) + service)
        .or_throw();
  };
  const std::string serving = "\x08\x01", not_serving = "\x08\x02";
  EXPECT_EQ(health_of("relmap.v1.Ingest"), serving);
  server_->set_serving("relmap.v1.Ingest", false);
  EXPECT_EQ(health_of("relmap.v1.Ingest"), not_serving);
  EXPECT_EQ(health_of("relmap.v1.Map"), serving);
  server_->announce_stop();
  server_->set_serving("relmap.v1.Map", true);
  EXPECT_EQ(health_of("relmap.v1.Map"), not_serving) << "nothing takes that back";
  EXPECT_EQ(call_raw("/grpc.health.v1.Health/Check", "").or_throw(), not_serving);
  v1::GetFrameReply frame;
  EXPECT_TRUE(get_frame({1, 1}, &frame).ok()) << "nobody is turned away yet";
}

TEST_F(Server, CallsBeyondTheLimitsAreRefusedAtOnce) {
  Core crowded(*map_.mapper, map_.core->facts, {.max_pictures = 0});
  const auto server = RpcServer::start(crowded, everyone_, {.host = "127.0.0.1"}).or_throw();
  const auto stub = v1::Map::NewStub(
      grpc::CreateChannel("127.0.0.1:" + std::to_string(server->port()), grpc::InsecureChannelCredentials()));
  v1::LocaliseReply reply;
  const grpc::Status status = stub->Localise(context().get(), {}, &reply);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(error_of(status).reason(), v1::REASON_BUDGET_EXCEEDED);
  v1::GetStatusReply other;
  EXPECT_TRUE(stub->GetStatus(context().get(), {}, &other).ok());
  // A call releases its budget a moment after its answer.
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  while (map_.mapper->budget().used(storage::Share::kReplies) > 0 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(map_.mapper->budget().used(storage::Share::kReplies), 0u);
}

TEST_F(Server, ASecondServerOnThePortIsRefusedByName) {
  const auto second = RpcServer::start(*map_.core, everyone_, {.host = "127.0.0.1", .port = server_->port()});
  EXPECT_EQ(second.reason(), Reason::PORT_IN_USE);
  EXPECT_THAT(second.status().message(), testing::HasSubstr(address_));
}

TEST_F(Server, StoppingRefusesNewCallsAndEndsRunningOnes) {
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    server_->stop(kStopPatience);
  });
  v1::GetFrameReply reply;
  grpc::Status status;
  while ((status = get_frame({1, 1}, &reply)).ok()) {
  }
  // The call is refused by us or, a moment later, by gRPC itself.
  EXPECT_THAT(status.error_code(), testing::AnyOf(grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::CANCELLED));
  stopper.join();  // stop() has not waited for its deadline
}

TEST_F(Server, StoppingDoesNotWaitForIdleConnections) {
  v1::GetFrameReply reply;
  ASSERT_TRUE(get_frame({1, 1}, &reply).ok());
  ASSERT_EQ(channel_->GetState(false), GRPC_CHANNEL_READY) << "the connection stays";
  server_->stop(kStopPatience);  // returns, although its deadline is far away
  EXPECT_FALSE(get_frame({1, 1}, &reply).ok()) << "it has not stopped";
}

TEST(Roles, EveryMethodHasOne) {
  for (const auto* service :
       {v1::Map::service_full_name(), v1::Ingest::service_full_name(), v1::Admin::service_full_name()}) {
    const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
    ASSERT_TRUE(descriptor);
    for (int i = 0; i < descriptor->method_count(); ++i)
      EXPECT_TRUE(required_role(descriptor->name() + "." + descriptor->method(i)->name()))
          << descriptor->method(i)->full_name();
  }
  EXPECT_FALSE(required_role("Map.Nonsense"));
  EXPECT_EQ(required_role("Map.SetEdgeState"), Role::kOperator);
  EXPECT_EQ(required_role("Map.ProposeEdge"), Role::kOperator);
}

TEST(ErrorMapping, NoRefusalIsOk) {
  for (const Reason reason : {Reason::NO_SUCH_FRAME, Reason::NEW_PLACE, Reason::BUDGET_EXCEEDED, Reason::INTERNAL})
    EXPECT_NE(status_code(reason), grpc::StatusCode::OK);
  EXPECT_EQ(status_code(Reason::DEADLINE), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(status_code(Reason::VIEW_EXPIRED), grpc::StatusCode::ABORTED);
}

}  // namespace
}  // namespace relmap::rpc
