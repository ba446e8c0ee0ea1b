// Robots over gRPC: a client's stream to a server with its intake and a map.
#include "server/rpc/ingest_stream.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>

#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "relmap/v1/ingest.grpc.pb.h"
#include "relmap/v1/status.pb.h"
#include "server/ingest/mapper_sink.h"
#include "server/rpc/handlers.h"
#include "server/rpc/server.h"
#include "server/rpc/testing/served_map.h"

namespace relmap::rpc {
namespace {

constexpr std::uint32_t kKeyframes = 20;

sim::PointsWorldOptions robot_options() {
  sim::PointsWorldOptions options = ServedMap::circuit_options();
  options.uuid.bytes[15] = 3;
  options.session = "robot";
  options.frames = kKeyframes;
  options.noise_seed = 7;
  return options;
}

class IngestStreamTest : public testing::Test {
 protected:
  using Stream = grpc::ClientReaderWriter<v1::IngestRequest, v1::IngestReply>;

  void SetUp() override { start(); }
  void start(RpcLimits limits = {}) {
    server_.reset();
    core_ = std::make_unique<Core>(*map_.mapper, map_.core->facts, limits);
    sink_ = std::make_unique<ingest::MapperSink>(*map_.mapper);
    intake::IngestServerOptions options;
    options.map = map_.mapper->identity();
    intake_ = std::make_unique<intake::IngestServer>(*sink_, map_.mapper->budget(), BootId{4, 2}, std::move(options));
    core_->intake.server = intake_.get();
    server_ = RpcServer::start(*core_, everyone_, {.host = "127.0.0.1"}).or_throw();
    stub_ = v1::Ingest::NewStub(
        grpc::CreateChannel("127.0.0.1:" + std::to_string(server_->port()), grpc::InsecureChannelCredentials()));
  }
  void TearDown() override {
    intake_->stop();
    server_.reset();
  }

  std::unique_ptr<Stream> open(grpc::ClientContext& context, std::uint32_t major = kProtocolMajor) {
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(10));
    auto stream = stub_->Stream(&context);
    v1::IngestRequest hello;
    hello.mutable_hello()->mutable_protocol()->set_major(major);
    hello.mutable_hello()->set_robot("robot");
    stream->Write(hello);
    return stream;
  }
  // Opens two streams, and expects that there is no room for a third.
  void expect_two(grpc::ClientContext (&contexts)[3], std::unique_ptr<Stream> (&streams)[2]) {
    v1::IngestReply reply;
    for (int i = 0; i < 2; ++i) {
      streams[i] = open(contexts[i]);
      ASSERT_TRUE(streams[i]->Read(&reply));
    }
    EXPECT_EQ(reason_of(open(contexts[2])->Finish()), Reason::BUDGET_EXCEEDED);
  }
  v1::IngestRequest keyframe(std::uint32_t i, const SessionUuid* uuid = nullptr) const {
    Keyframe k = world_.keyframe(i);
    if (uuid) k.session.uuid = *uuid;
    const Bytes payload = encode_keyframe(k);
    v1::IngestRequest request;
    request.mutable_keyframe()->set_session_uuid(uuid_to_wire(k.session.uuid));
    request.mutable_keyframe()->set_sequence(k.sequence);
    request.mutable_keyframe()->set_crc32c(crc32c(payload));
    request.mutable_keyframe()->set_payload(payload.data(), payload.size());
    return request;
  }
  // The first acknowledgement with this next sequence.
  std::optional<v1::Acknowledgement> acknowledged(Stream& stream, std::uint64_t next) {
    v1::IngestReply reply;
    while (stream.Read(&reply))
      if (reply.has_acknowledgement() && reply.acknowledgement().next_sequence() >= next)
        return reply.acknowledgement();
    return std::nullopt;
  }
  static Reason reason_of(const grpc::Status& status) {
    v1::Error error;
    EXPECT_TRUE(error.ParseFromString(status.error_details())) << status.error_message();
    return reason_from_wire(error.reason());
  }

  ServedMap map_;
  const sim::PointsWorld world_{robot_options()};
  std::unique_ptr<Core> core_;
  std::unique_ptr<ingest::MapperSink> sink_;
  std::unique_ptr<intake::IngestServer> intake_;
  const Gatekeeper everyone_{"", true};
  std::unique_ptr<RpcServer> server_;
  std::unique_ptr<v1::Ingest::Stub> stub_;
};

TEST_F(IngestStreamTest, WelcomesARobotAndAcknowledgesWhatIsDurable) {
  grpc::ClientContext context;
  const auto stream = open(context);
  v1::IngestReply reply;
  ASSERT_TRUE(stream->Read(&reply));
  ASSERT_TRUE(reply.has_welcome());
  EXPECT_EQ(reply.welcome().boot_id(), std::string(intake_->identity().boot.begin(), intake_->identity().boot.end()));
  EXPECT_EQ(reply.welcome().map_uuid(), uuid_to_wire(intake_->identity().map.uuid));
  EXPECT_EQ(reply.welcome().map_epoch(), intake_->identity().map.epoch);
  EXPECT_TRUE(intake_->identity().map.known());
  for (std::uint32_t i = 0; i < kKeyframes; ++i) ASSERT_TRUE(stream->Write(keyframe(i)));
  const auto ack = acknowledged(*stream, kKeyframes);
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->session(), 3u);
  EXPECT_EQ(ack->session_uuid(), uuid_to_wire(world_.keyframe(0).session.uuid));
  EXPECT_GE(ack->credits(), 1u);

  ASSERT_TRUE(stream->Write(keyframe(3)));  // a repeat is acknowledged again and changes nothing
  EXPECT_EQ(acknowledged(*stream, kKeyframes)->next_sequence(), kKeyframes);
  stream->WritesDone();
  while (stream->Read(&reply)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  map_.settle();
  EXPECT_EQ(map_.mapper->view()->session(3)->frames, kKeyframes);
}

TEST_F(IngestStreamTest, AnotherStreamContinuesWhereTheFirstBrokeAndSendsOnlyTheNewestAcknowledgement) {
  {
    grpc::ClientContext context;
    const auto stream = open(context);
    for (std::uint32_t i = 0; i < 5; ++i) stream->Write(keyframe(i));
    ASSERT_TRUE(acknowledged(*stream, 5));
    context.TryCancel();
  }
  grpc::ClientContext context;
  const auto stream = open(context);
  for (std::uint32_t i = 0; i < 12; ++i) stream->Write(keyframe(i));
  EXPECT_TRUE(acknowledged(*stream, 12));

  v1::GetAcknowledgementRequest request;
  request.set_session_uuid(uuid_to_wire(world_.keyframe(0).session.uuid));
  grpc::ClientContext asked;
  v1::Acknowledgement ack;
  ASSERT_TRUE(stub_->GetAcknowledgement(&asked, request, &ack).ok());
  EXPECT_EQ(ack.next_sequence(), 12u);
  request.set_session_uuid(uuid_to_wire(SessionUuid::random()));
  grpc::ClientContext of_nobody;
  EXPECT_EQ(reason_of(stub_->GetAcknowledgement(&of_nobody, request, &ack)), Reason::NO_SUCH_SESSION);
  context.TryCancel();

  v1::ListRobotsReply robots = call(*core_, list_robots, {}, {}).or_throw();
  ASSERT_EQ(robots.robots_size(), 1);
  EXPECT_EQ(robots.robots(0).session(), 3u);
  EXPECT_EQ(robots.robots(0).next_sequence(), 12u);
  EXPECT_EQ(robots.robots(0).blocked(), v1::REASON_OK);
  EXPECT_GT(robots.robots(0).keyframes_per_s(), 1);
}

TEST_F(IngestStreamTest, GapsEndsAndRefusalsTravel) {
  grpc::ClientContext context;
  const auto stream = open(context);
  stream->Write(keyframe(0));
  v1::IngestRequest request;
  request.mutable_gap()->set_session_uuid(uuid_to_wire(world_.keyframe(0).session.uuid));
  request.mutable_gap()->set_first(1);
  request.mutable_gap()->set_last(4);
  request.mutable_gap()->set_reason(v1::REASON_DROPPED_BY_ROBOT);
  stream->Write(request);
  request = keyframe(5);
  request.mutable_keyframe()->set_payload("no keyframe");
  const std::string damaged = request.keyframe().payload();
  request.mutable_keyframe()->set_crc32c(
      crc32c({reinterpret_cast<const std::uint8_t*>(damaged.data()), damaged.size()}));
  stream->Write(request);
  stream->Write(keyframe(6));
  const auto ack = acknowledged(*stream, 7);
  ASSERT_TRUE(ack);
  ASSERT_EQ(ack->refused_size(), 1);
  EXPECT_EQ(ack->refused(0).sequence(), 5u);
  EXPECT_EQ(ack->refused(0).reason(), v1::REASON_CORRUPT);

  request.mutable_end()->set_session_uuid(uuid_to_wire(world_.keyframe(0).session.uuid));
  request.mutable_end()->set_next_sequence(7);
  stream->Write(request);
  v1::IngestReply reply;
  while (stream->Read(&reply) && !reply.has_ended()) {
  }
  EXPECT_TRUE(reply.has_ended());
  map_.settle();
  EXPECT_EQ(map_.mapper->view()->session(3)->state, storage::SessionState::kEnded);
  EXPECT_EQ(map_.mapper->view()->session(3)->given_up, 4u);
  context.TryCancel();
}

TEST_F(IngestStreamTest, NewsAreSentToTheirRobot) {
  grpc::ClientContext context;
  const auto stream = open(context);
  stream->Write(keyframe(0));
  ASSERT_TRUE(acknowledged(*stream, 1));
  PoseNews news;
  news.session = world_.keyframe(0).session.uuid;
  news.kind = PoseNews::Kind::kClosureOut;
  news.keyframe = {3, 0};
  news.frame = {1, 7};
  news.covariance = Matrix6::Identity();
  PoseNews foreign = news;
  foreign.session = SessionUuid::random();
  foreign.frame = {1, 8};
  PoseNews slower;
  slower.session = news.session;
  slower.kind = PoseNews::Kind::kSlowDown;
  slower.rate_hz = 2.5;
  for (const PoseNews& one : {foreign, news, slower}) intake_->tell(one, world_.keyframe(0).session.robot);
  v1::IngestReply reply;
  while (stream->Read(&reply) && !reply.has_localisation()) {
  }
  EXPECT_EQ(reply.localisation().frame().index(), 7u);
  EXPECT_EQ(reply.localisation().session(), 3u);
  EXPECT_TRUE(reply.localisation().withdrawn());
  while (stream->Read(&reply) && !reply.has_pace()) {
  }
  EXPECT_EQ(reply.pace().rate_hz(), 2.5);
  context.TryCancel();
}

TEST_F(IngestStreamTest, AnInvalidStreamIsRefusedByName) {
  {
    grpc::ClientContext context;
    EXPECT_EQ(reason_of(open(context, 2)->Finish()), Reason::UNKNOWN_PROTOCOL_VERSION);
  }
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(10));
  auto stream = stub_->Stream(&context);
  stream->Write(keyframe(0));
  EXPECT_EQ(reason_of(stream->Finish()), Reason::INVALID_ARGUMENT);

  grpc::ClientContext other;
  stream = open(other);
  v1::IngestRequest nonsense;
  stream->Write(nonsense);
  nonsense.mutable_keyframe()->set_session_uuid("short");
  stream->Write(nonsense);
  stream->Write(keyframe(0));
  EXPECT_TRUE(acknowledged(*stream, 1)) << "what is nothing is counted, and the stream goes on";
  EXPECT_EQ(intake_->stats().messages_refused[intake::index_of(Reason::INVALID_ARGUMENT)], 2u);
  other.TryCancel();
}

TEST_F(IngestStreamTest, StreamsHaveALimitOfTheirOwnAndEndWithTheDaemon) {
  start({.max_concurrent = 1, .max_ingest_streams = 2});
  grpc::ClientContext contexts[3];
  std::unique_ptr<Stream> streams[2];
  ASSERT_NO_FATAL_FAILURE(expect_two(contexts, streams));
  v1::IngestReply reply;
  v1::GetAcknowledgementRequest request;
  request.set_session_uuid(uuid_to_wire(SessionUuid::random()));
  grpc::ClientContext asked;
  v1::Acknowledgement ack;
  EXPECT_EQ(reason_of(stub_->GetAcknowledgement(&asked, request, &ack)), Reason::NO_SUCH_SESSION)
      << "questions are answered beside them";
  streams[0]->Write(keyframe(0));
  intake_->stop();
  for (const auto& stream : streams) {
    while (stream->Read(&reply)) {
    }
    EXPECT_EQ(reason_of(stream->Finish()), Reason::SHUTTING_DOWN);
  }
}

TEST_F(IngestStreamTest, OneCallerHasSoManyStreams) {
  start({.max_ingest_streams = 10, .max_ingest_streams_per_caller = 2});
  grpc::ClientContext contexts[3];
  std::unique_ptr<Stream> streams[2];
  ASSERT_NO_FATAL_FAILURE(expect_two(contexts, streams));
  for (grpc::ClientContext& context : contexts) context.TryCancel();
}

}  // namespace
}  // namespace relmap::rpc
