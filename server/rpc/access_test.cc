// Who gets in: callers with and without credentials, over TLS and at the Unix socket, against a real server.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grp.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "client/relmap_client.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "relmap/v1/admin.grpc.pb.h"
#include "relmap/v1/ingest.grpc.pb.h"
#include "relmap/v1/map.grpc.pb.h"
#include "server/ingest/mapper_sink.h"
#include "server/rpc/roles.h"
#include "server/rpc/server.h"
#include "server/rpc/testing/fleet_credentials.h"
#include "server/rpc/testing/served_map.h"
#include "storage/testing/event_follower.h"

namespace relmap::rpc {
namespace {

using grpc::StatusCode;
using testing::HasSubstr;

class AccessTest : public testing::Test {
 protected:
  void start(ConnectionLimits limits = {}) {
    sink_ = std::make_unique<ingest::MapperSink>(*map_.mapper);
    intake_ = std::make_unique<intake::IngestServer>(*sink_, map_.mapper->budget(), BootId{4, 2},
                                                     intake::IngestServerOptions{});
    map_.core->intake.server = intake_.get();
    gatekeeper_ = std::make_unique<Gatekeeper>(fleet_.file("access"));
    ASSERT_TRUE(gatekeeper_->reload().ok());
    ServerOptions options{fleet_.file("socket"), "", "127.0.0.1", 0, fleet_.tls(), limits};
    options.audit = audit_.get();
    server_ = RpcServer::start(*map_.core, *gatekeeper_, options).or_throw();
  }
  ~AccessTest() override {
    if (intake_) intake_->stop();
    server_.reset();
  }

  // A connection by hand, over which nothing is sent.
  int connect_stranger() const {
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(server_->port());
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&where), sizeof where), 0);
    return fd;
  }
  static bool is_closed(int fd) {
    char byte;
    return recv(fd, &byte, 1, MSG_DONTWAIT | MSG_PEEK) == 0;
  }

  std::string address() const { return "127.0.0.1:" + std::to_string(server_->port()); }
  std::string socket() const { return "unix:" + fleet_.file("socket"); }
  std::shared_ptr<grpc::Channel> channel(const access::Credentials& shown) const {
    std::shared_ptr<grpc::ChannelCredentials> by =
        grpc::SslCredentials({shown.authorities, shown.key, shown.certificate});
    if (!shown.token.empty()) by = grpc::CompositeChannelCredentials(by, grpc::AccessTokenCredentials(shown.token));
    return open(address(), by);
  }
  static std::shared_ptr<grpc::Channel> open(const std::string& address,
                                             const std::shared_ptr<grpc::ChannelCredentials>& by) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // no connection is shared with another test
    return grpc::CreateCustomChannel(address, by, arguments);
  }
  access::Credentials nothing() const { return {fleet_.authority().certificate, "", "", ""}; }

  // Calls a method with an empty request; the code of its outcome.
  static grpc::Status call(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                           const std::string& request = "") {
    grpc::GenericStub stub(channel);
    grpc::CompletionQueue queue;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
    const grpc::Slice slice(request);
    const auto reader = stub.PrepareUnaryCall(&context, path, grpc::ByteBuffer(&slice, 1), &queue);
    grpc::ByteBuffer reply;
    grpc::Status status;
    reader->StartCall();
    reader->Finish(&reply, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    return status;
  }

  ServedMap map_;
  FleetCredentials fleet_;
  std::unique_ptr<ingest::MapperSink> sink_;
  std::unique_ptr<intake::IngestServer> intake_;
  std::unique_ptr<Gatekeeper> gatekeeper_;
  std::unique_ptr<AuditLog> audit_;  // null: none
  std::unique_ptr<RpcServer> server_;
};

// What gRPC says of handshakes that fail, as they must here, would hide all else.
const int kQuiet = setenv("GRPC_VERBOSITY", "NONE", 0);

constexpr char kStatus[] = "/relmap.v1.Map/GetStatus";
constexpr char kHealth[] = "/grpc.health.v1.Health/Check";
constexpr char kReflection[] = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
const std::string kListServices("\x3a\x00", 2);

struct Method {
  std::string name, path;
};
std::vector<Method> all_methods() {
  std::vector<Method> methods;
  for (const auto* service :
       {v1::Map::service_full_name(), v1::Ingest::service_full_name(), v1::Admin::service_full_name()}) {
    const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
    for (int i = 0; i < descriptor->method_count(); ++i)
      methods.push_back({descriptor->name() + "." + descriptor->method(i)->name(),
                         "/" + descriptor->full_name() + "/" + descriptor->method(i)->name()});
  }
  return methods;
}

// Written out here, so that a method that is opened to others by mistake is found.
Role expected_role(const std::string& method) {
  static const std::set<std::string> readers{
      "Map.Localise",         "Map.MatchImage",       "Map.FindRoute",    "Map.GetNeighbourhood",
      "Map.TransformBetween", "Map.GetFrame",         "Map.ListSessions", "Map.ListEdges",
      "Map.ExplainEdge",      "Map.GetClosureMatrix", "Map.GetSkeleton",  "Map.FindLabels",
      "Map.WatchMap",         "Map.ListRobots",       "Map.GetStatus",    "Map.Export"};
  if (readers.contains(method)) return Role::kReader;
  return method.starts_with("Ingest.") ? Role::kRobot : Role::kOperator;
}

TEST_F(AccessTest, EachRoleMayCallWhatIsForItAndNothingElse) {
  const std::map<Role, access::Credentials> certificates{
      {Role::kReader, fleet_.certificate(Role::kReader, "reader")},
      {Role::kRobot, fleet_.certificate(Role::kRobot, "cart")},
      {Role::kOperator, fleet_.certificate(Role::kOperator, "boss")}};
  const std::map<Role, access::Credentials> tokens{{Role::kReader, fleet_.token(Role::kReader, "reader")},
                                                   {Role::kRobot, fleet_.token(Role::kRobot, "cart")},
                                                   {Role::kOperator, fleet_.token(Role::kOperator, "boss")}};
  start();
  for (const auto* credentials : {&certificates, &tokens}) {
    for (const auto& [role, shown] : *credentials) {
      const auto by = channel(shown);
      for (const Method& method : all_methods()) {
        // A watch has no end, but with a token that is none it has no beginning either.
        const std::string request = method.name == "Map.WatchMap" ? std::string("\x12\x01?") : std::string();
        const grpc::Status status = call(by, method.path, request);
        const Role needed = expected_role(method.name);
        EXPECT_NE(status.error_code(), StatusCode::UNAUTHENTICATED) << method.name << ": " << status.error_message();
        EXPECT_NE(status.error_code(), StatusCode::UNAVAILABLE) << method.name << ": " << status.error_message();
        EXPECT_EQ(status.error_code() == StatusCode::PERMISSION_DENIED, role < needed)
            << access::role_name(role) << " " << method.name << ": " << status.error_message();
        if (role >= needed) continue;
        EXPECT_THAT(status.error_message(), HasSubstr("role " + std::string(access::role_name(needed))));
        v1::Error error;
        EXPECT_TRUE(error.ParseFromString(status.error_details()));
        EXPECT_EQ(error.reason(), v1::REASON_NOT_ALLOWED);
      }
    }
  }
}

TEST_F(AccessTest, StatusTellsCallersWhoTheyAre) {
  const auto cart = fleet_.certificate(Role::kRobot, "cart");
  const auto ann = fleet_.token(Role::kReader, "ann");
  start();
  const auto told = [&](const std::shared_ptr<grpc::Channel>& by) {
    grpc::ClientContext context;
    v1::GetStatusReply reply;
    const grpc::Status status = v1::Map::NewStub(by)->GetStatus(&context, {}, &reply);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return reply.caller_name() + " " + reply.caller_role();
  };
  EXPECT_EQ(told(channel(cart)), "cart robot");
  EXPECT_EQ(told(channel(ann)), "ann reader");
  EXPECT_EQ(told(open(socket(), grpc::InsecureChannelCredentials())), "local operator");
}

TEST_F(AccessTest, AnEditIsOfTheCallerWhomTheCredentialsName) {
  const auto boss = fleet_.certificate(Role::kOperator, "boss");
  const auto ann = fleet_.token(Role::kOperator, "ann");
  start();
  const auto label = [&](const std::shared_ptr<grpc::Channel>& by) {
    v1::SetLabelRequest request;
    *request.mutable_frame() = to_wire(FrameId{1, 7});
    request.set_label("by " + std::to_string(map_.mapper->stats().durable_sequence));
    const grpc::Status status = call(by, "/relmap.v1.Map/SetLabel", request.SerializeAsString());
    EXPECT_TRUE(status.ok()) << status.error_message();
    (void)map_.mapper->commit(Deadline().at).or_throw();
    const auto snapshot = map_.mapper->view()->committed();
    storage::EventFollower follower;
    follower.follow(*snapshot, std::size_t{1} << 20);
    for (auto event = follower.events().rbegin(); event != follower.events().rend(); ++event)
      if (std::holds_alternative<storage::LabelsEvent>(event->content)) return event->submitted.author;
    return std::string("nobody");
  };
  EXPECT_EQ(label(channel(boss)), "boss");
  EXPECT_EQ(label(channel(ann)), "ann");
  EXPECT_NE(label(open(socket(), grpc::InsecureChannelCredentials())), "") << "whoever can open it has a name too";
}

TEST_F(AccessTest, WithoutCredentialsThereIsNothingButHealth) {
  start();
  access::Credentials guess = nothing();
  guess.token = access::new_token();
  for (const access::Credentials& shown : {nothing(), guess}) {
    const auto stranger = channel(shown);
    for (const Method& method : all_methods())
      EXPECT_EQ(call(stranger, method.path).error_code(), StatusCode::UNAUTHENTICATED) << method.name;
    EXPECT_EQ(call(stranger, kReflection, kListServices).error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(call(stranger, "/relmap.v1.Map/Nonsense").error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_TRUE(call(stranger, kHealth).ok());
  }
}

TEST_F(AccessTest, CertificatesOfOthersDoNotEvenConnect) {
  start();
  const access::KeyPair other = access::new_authority("fleet", 1);  // of the same name
  const auto forged = access::issue(other, {"boss", {}, access::Principal{Role::kOperator, "boss"}, 1}).or_throw();
  EXPECT_EQ(call(channel({fleet_.authority().certificate, forged.certificate, forged.key, ""}), kHealth).error_code(),
            StatusCode::UNAVAILABLE);
  // An expired one of this fleet.
  const auto late =
      access::issue(fleet_.authority(), {"boss", {}, access::Principal{Role::kOperator, "boss"}, -1}).or_throw();
  EXPECT_EQ(call(channel({fleet_.authority().certificate, late.certificate, late.key, ""}), kHealth).error_code(),
            StatusCode::UNAVAILABLE);
  // And a caller believes no daemon of another fleet, nor speaks to this one without TLS.
  EXPECT_EQ(call(channel({other.certificate, "", "", ""}), kHealth).error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(call(open(address(), grpc::InsecureChannelCredentials()), kHealth).error_code(), StatusCode::UNAVAILABLE);
}

TEST_F(AccessTest, WhoeverCanOpenTheSocketIsAnOperator) {
  start();
  struct stat facts {};
  ASSERT_EQ(stat(fleet_.file("socket").c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0600u);
  const auto local = open(socket(), grpc::InsecureChannelCredentials());
  EXPECT_TRUE(call(local, "/relmap.v1.Admin/GetStats").ok());
  EXPECT_TRUE(call(local, kReflection, kListServices).ok());
  EXPECT_FALSE(std::filesystem::exists(fleet_.file("socket.new")));
}

TEST_F(AccessTest, MembersOfAGroupCanOpenASocketThatIsForThem) {
  const group* const own = getgrgid(getegid());
  ASSERT_TRUE(own);
  const auto listening = ListeningSocket::at_path(fleet_.file("group"), own->gr_name);
  ASSERT_TRUE(listening.ok()) << listening.status().to_string();
  struct stat facts {};
  ASSERT_EQ(stat(fleet_.file("group").c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0660u);
  EXPECT_EQ(facts.st_gid, getegid());
  EXPECT_EQ(ListeningSocket::at_path(fleet_.file("none"), "no-such-group").reason(), Reason::BAD_CONFIG);
  EXPECT_FALSE(std::filesystem::exists(fleet_.file("none")));
}

TEST_F(AccessTest, ARevokedCallerLosesHisStreamsToo) {
  const access::Credentials cart = fleet_.certificate(Role::kRobot, "cart");
  start();
  const auto stub = v1::Ingest::NewStub(channel(cart));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
  const auto stream = stub->Stream(&context);
  v1::IngestRequest hello;
  hello.mutable_hello()->mutable_protocol()->set_major(kProtocolMajor);
  hello.mutable_hello()->set_robot("cart");
  stream->Write(hello);
  v1::IngestReply reply;
  ASSERT_TRUE(stream->Read(&reply)) << stream->Finish().error_message();
  ASSERT_EQ(kQuiet, 0);
  fleet_.revoke("cart");
  ASSERT_TRUE(gatekeeper_->reload_if_changed().ok());
  v1::IngestRequest end;
  end.mutable_end()->set_session_uuid(std::string(16, 'x'));
  stream->Write(end);
  while (stream->Read(&reply)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::UNAUTHENTICATED);
}

TEST_F(AccessTest, ARobotHasOnlyItsOwnSessions) {
  sim::PointsWorldOptions world_options = ServedMap::circuit_options();
  world_options.uuid.bytes[15] = 9;
  world_options.session = "of the other";
  world_options.frames = 3;
  const sim::PointsWorld world(world_options);  // of the robot that drove the map
  const std::string robot = world.keyframe(0).session.robot;
  const access::Credentials own = fleet_.certificate(Role::kRobot, robot), thief = fleet_.token(Role::kRobot, "thief");
  start();
  const auto request_of = [&](std::uint32_t i, const std::string& as = {}) {
    Keyframe keyframe = world.keyframe(i);
    if (!as.empty()) keyframe.session.robot = as;
    const Bytes payload = encode_keyframe(keyframe);
    v1::IngestRequest request;
    request.mutable_keyframe()->set_session_uuid(uuid_to_wire(keyframe.session.uuid));
    request.mutable_keyframe()->set_sequence(keyframe.sequence);
    request.mutable_keyframe()->set_crc32c(crc32c(payload));
    request.mutable_keyframe()->set_payload(payload.data(), payload.size());
    return request;
  };
  // Sends and returns how the stream ended, or what was settled.
  struct Outcome {
    StatusCode code = StatusCode::OK;
    std::uint64_t next = 0;
  };
  const auto send = [&](const access::Credentials& shown, const std::string& name,
                        const std::vector<v1::IngestRequest>& requests, std::uint64_t until) {
    const auto stub = v1::Ingest::NewStub(channel(shown));
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
    const auto stream = stub->Stream(&context);
    v1::IngestRequest hello;
    hello.mutable_hello()->mutable_protocol()->set_major(kProtocolMajor);
    hello.mutable_hello()->set_robot(name);
    stream->Write(hello);
    for (const v1::IngestRequest& request : requests) stream->Write(request);
    Outcome outcome;
    for (v1::IngestReply reply; outcome.next < until && stream->Read(&reply);)
      if (reply.has_acknowledgement()) outcome.next = reply.acknowledgement().next_sequence();
    if (outcome.next >= until) context.TryCancel();
    const grpc::Status end = stream->Finish();
    if (outcome.next < until) outcome.code = end.error_code();
    return outcome;
  };
  const std::uint64_t frames = map_.mapper->view()->state().keyframes;
  EXPECT_EQ(send(thief, robot, {}, 1).code, StatusCode::PERMISSION_DENIED) << "under another's name";
  EXPECT_EQ(send(own, robot, {request_of(0)}, 1).next, 1u);
  map_.settle();
  const std::uint64_t applied = map_.mapper->view()->state().applied_sequence;

  v1::IngestRequest gap, end;
  gap.mutable_gap()->set_session_uuid(uuid_to_wire(world.keyframe(0).session.uuid));
  gap.mutable_gap()->set_first(1);
  gap.mutable_gap()->set_last(2);
  gap.mutable_gap()->set_reason(v1::REASON_DROPPED_BY_ROBOT);
  end.mutable_end()->set_session_uuid(uuid_to_wire(world.keyframe(0).session.uuid));
  end.mutable_end()->set_next_sequence(1);
  v1::IngestRequest garbage = request_of(1);
  garbage.mutable_keyframe()->set_payload("garbage");
  garbage.mutable_keyframe()->set_crc32c(crc32c(ByteSpan(reinterpret_cast<const std::uint8_t*>("garbage"), 7)));
  for (const v1::IngestRequest& attack : {request_of(1), request_of(1, "thief"), gap, end, garbage})
    EXPECT_EQ(send(thief, "thief", {attack}, 2).code, StatusCode::PERMISSION_DENIED) << attack.content_case();
  // Keyframes of another robot begin no session, and the owner's goes on where it was.
  map_.settle();
  EXPECT_EQ(map_.mapper->view()->state().keyframes, frames + 1);
  EXPECT_EQ(map_.mapper->view()->state().applied_sequence, applied) << "no record of any kind";
  EXPECT_EQ(send(own, robot, {request_of(1), request_of(2)}, 3).next, 3u);
  map_.settle();
  EXPECT_EQ(map_.mapper->view()->state().keyframes, frames + 3);
}

TEST_F(AccessTest, ASessionThatHasNotBegunIsOfWhoSentForItFirst) {
  sim::PointsWorldOptions world_options = ServedMap::circuit_options();
  world_options.uuid.bytes[15] = 10;
  world_options.frames = 2;
  const sim::PointsWorld world(world_options);
  const SessionUuid uuid = world.keyframe(0).session.uuid;
  start();
  const Bytes payload = encode_keyframe(world.keyframe(0));
  const std::uint64_t frames = map_.mapper->view()->state().keyframes;
  // The keyframe is of another robot than the sender: it is refused for good, and begins nothing.
  std::vector<Reason> taken;
  const auto note = [&](const Status& status) { taken.push_back(status.reason()); };
  intake_->take_payload(uuid, 0, crc32c(payload), payload, {"thief"}, note);
  intake_->take_payload(uuid, 0, crc32c(payload), payload, {"second"}, note);
  intake_->take_end({uuid, 1}, {"second"}, note);
  EXPECT_THAT(taken, testing::ElementsAre(Reason::OK, Reason::NOT_ALLOWED, Reason::NOT_ALLOWED));
  EXPECT_EQ(intake_->stats().refused_before_begin[intake::index_of(Reason::NOT_ALLOWED)], 1u);
  EXPECT_EQ(map_.mapper->view()->state().keyframes, frames);
}

TEST_F(AccessTest, ConnectionsAreLimitedAndStrangersMakeRoomForThoseWhoAreKnown) {
  const access::Credentials boss = fleet_.certificate(Role::kOperator, "boss");
  start({.total = 8, .per_peer = 4});
  const auto known = channel(boss);
  ASSERT_TRUE(call(known, kStatus).ok());
  std::vector<int> strangers;
  for (int i = 0; i < 20; ++i) strangers.push_back(connect_stranger());
  const auto closed = [&] { return std::count_if(strangers.begin(), strangers.end(), is_closed); };
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (closed() < 17 && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_GE(closed(), 17);  // the other three have ten seconds for their handshakes
  for (int i = 0; i < 16; ++i) EXPECT_TRUE(is_closed(strangers[static_cast<std::size_t>(i)])) << "the oldest go first";
  EXPECT_EQ(known->GetState(false), GRPC_CHANNEL_READY) << "who is known stays";
  for (int i = 0; i < 3; ++i) {
    const grpc::Status status = call(channel(boss), kStatus);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  EXPECT_TRUE(call(open(socket(), grpc::InsecureChannelCredentials()), kStatus).ok());
  for (const int fd : strangers) close(fd);
}

// Known callers are not pushed out by one another.
TEST_F(AccessTest, WhereAllAreKnownNewConnectionsAreRefused) {
  const access::Credentials boss = fleet_.certificate(Role::kOperator, "boss");
  start({.total = 8, .per_peer = 3});
  std::vector<std::shared_ptr<grpc::Channel>> known;
  for (int i = 0; i < 3; ++i) {
    known.push_back(channel(boss));
    ASSERT_TRUE(call(known.back(), kStatus).ok());
  }
  EXPECT_EQ(call(channel(boss), kStatus).error_code(), StatusCode::UNAVAILABLE);
  for (const auto& one : known) EXPECT_EQ(one->GetState(false), GRPC_CHANNEL_READY);
  known.pop_back();
  // One that has gone counts no more.
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  grpc::Status status;
  do status = call(channel(boss), kStatus);
  while (!status.ok() && std::chrono::steady_clock::now() < until);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(AccessTest, AStoppedServerRefusesConnectionsAndItsSocketIsGone) {
  const access::Credentials boss = fleet_.certificate(Role::kOperator, "boss");
  start();
  ASSERT_TRUE(call(channel(boss), kStatus).ok());
  server_->stop(std::chrono::milliseconds(0));
  const int late = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(server_->port());
  where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_NE(connect(late, reinterpret_cast<const sockaddr*>(&where), sizeof where), 0);
  close(late);
  EXPECT_FALSE(std::filesystem::exists(fleet_.file("socket")));
}

TEST_F(AccessTest, NewCertificatesOfTheDaemonAreServedWithoutARestart) {
  const access::Credentials boss = fleet_.certificate(Role::kOperator, "boss");
  start();
  ASSERT_TRUE(call(channel(boss), kStatus).ok());
  const access::KeyPair later = access::new_authority("later", 1);
  const auto server = access::issue(later, {"relmapd", {"127.0.0.1"}, {}, 1}).or_throw();
  fleet_.write("server.pem", server.key + server.certificate);
  access::Credentials believes_later = boss;
  believes_later.authorities = later.certificate;
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (!call(channel(believes_later), kStatus).ok() && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_TRUE(call(channel(believes_later), kStatus).ok());
  EXPECT_EQ(call(channel(boss), kHealth).error_code(), StatusCode::UNAVAILABLE);
}

TEST_F(AccessTest, AnotherAuthorityOfCallersIsBelievedWithoutARestart) {
  start();
  const access::KeyPair later = access::new_authority("later", 1);
  const auto pair = access::issue(later, {"chief", {}, access::Principal{Role::kOperator, "chief"}, 1}).or_throw();
  const access::Credentials chief{fleet_.authority().certificate, pair.certificate, pair.key, ""};
  EXPECT_EQ(call(channel(chief), kHealth).error_code(), StatusCode::UNAVAILABLE);
  fleet_.write("ca.crt", later.certificate);
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (!call(channel(chief), kStatus).ok() && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_TRUE(call(channel(chief), kStatus).ok());
}

TEST_F(AccessTest, FilesThatDoNotBelongTogetherAreRefusedByName) {
  start();
  Gatekeeper gatekeeper;
  ServerOptions options{.host = "127.0.0.1", .tls = fleet_.tls()};
  fleet_.write("another.key", access::new_authority("another", 1).key);
  options.tls.key = fleet_.file("another.key");
  const auto mixed = RpcServer::start(*map_.core, gatekeeper, options);
  EXPECT_EQ(mixed.reason(), Reason::BAD_CONFIG);
  EXPECT_THAT(mixed.status().message(), HasSubstr("another.key"));
  ASSERT_EQ(chmod(fleet_.file("server.pem").c_str(), 0644), 0);
  const auto open = RpcServer::start(*map_.core, gatekeeper, {.host = "127.0.0.1", .tls = fleet_.tls()});
  EXPECT_EQ(open.reason(), Reason::BAD_CONFIG);
  EXPECT_THAT(open.status().message(), HasSubstr("others can read"));
  options.tls.certificate = fleet_.file("nowhere.crt");
  EXPECT_EQ(RpcServer::start(*map_.core, gatekeeper, options).reason(), Reason::BAD_CONFIG);
}

// The first message of a handshake (RFC 5246, 7.4.1.2), with ECDSA and RSA over P-256 and X25519.
std::string client_hello(char minor) {
  std::string body{'\3', minor};
  body += std::string(32, 'r') + std::string(1, '\0');
  body += std::string("\0\x08\xc0\x09\xc0\x2b\xc0\x13\xc0\x2f\x01\0", 12);    // suites; no compression
  body += std::string("\0\x1e\0\x0a\0\6\0\4\0\x17\0\x1d\0\x0b\0\2\1\0", 18);  // extensions: groups, point formats,
  body += std::string("\0\x0d\0\x0a\0\x08\4\3\4\1\x08\4\2\3", 14);            // signature algorithms
  const auto framed = [](const std::string& head, const std::string& content) {
    return head + static_cast<char>(content.size() >> 8) + static_cast<char>(content.size()) + content;
  };
  return framed("\x16\3\1", framed(std::string("\1\0", 2), body));
}

TEST_F(AccessTest, NoTlsBefore1_2IsSpoken) {
  start();
  const auto is_answered = [&](char minor) {
    const int fd = connect_stranger();
    const std::string hello = client_hello(minor);
    EXPECT_EQ(send(fd, hello.data(), hello.size(), 0), static_cast<ssize_t>(hello.size()));
    char kind = 0;
    const bool any = recv(fd, &kind, 1, MSG_WAITALL) == 1;
    close(fd);
    return any && kind == 0x16;  // the next message of the handshake
  };
  EXPECT_TRUE(is_answered(3));
  for (const char minor : {'\2', '\1', '\0'}) EXPECT_FALSE(is_answered(minor)) << "TLS 1." << minor - 1;
}

// Reading the audit log must not fill it: of a list of many pages, it has the call for the first one.
TEST_F(AccessTest, PagesOfTheAuditLogDoNotFillIt) {
  const storage::TemporaryFolder folder;
  audit_ = AuditLog::open(folder / "audit.jsonl").or_throw();
  for (int i = 0; i < 10; ++i) audit_->write({"anna", "operator", "", "Admin.Commit", "", "", Status()});
  const access::Credentials boss = fleet_.certificate(Role::kOperator, "boss"),
                            reader = fleet_.certificate(Role::kReader, "reader");
  start();
  const auto stub = v1::Admin::NewStub(channel(boss));
  const auto list = [&](v1::Admin::Stub& by, const std::string& token, v1::ListAuditReply& reply) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(5));
    v1::ListAuditRequest request;
    request.set_page_size(3);
    request.set_page_token(token);
    return by.ListAudit(&context, request, &reply);
  };
  std::vector<std::string> methods;
  std::string token;
  do {
    v1::ListAuditReply reply;
    ASSERT_TRUE(list(*stub, token, reply).ok());
    for (const v1::AuditEntry& entry : reply.entries()) methods.push_back(entry.method());
    token = reply.next_page_token();
  } while (!token.empty());
  EXPECT_EQ(methods, std::vector<std::string>(10, "Admin.Commit"));

  v1::ListAuditReply reply;
  EXPECT_EQ(list(*stub, "no token", reply).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(list(*v1::Admin::NewStub(channel(reader)), "", reply).error_code(), StatusCode::PERMISSION_DENIED);
  std::vector<std::string> told;
  const AuditPage page = audit_->read({}, [] { return Status(); }).or_throw();
  for (const AuditRead& entry : page.entries)
    if (entry.method == "Admin.ListAudit") told.push_back(entry.who + " " + std::string(reason_name(entry.outcome)));
  EXPECT_THAT(told, testing::ElementsAre("reader NOT_ALLOWED", "boss INVALID_ARGUMENT", "boss OK"));
}

}  // namespace
}  // namespace relmap::rpc
