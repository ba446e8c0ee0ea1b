// Watches over a real server: they hold no thread, are woken, are limited, and end with their callers, with their
// credentials and with the server.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "proto/base/clock.h"
#include "proto/wire/convert.h"
#include "relmap/v1/admin.grpc.pb.h"
#include "relmap/v1/map.grpc.pb.h"
#include "server/rpc/gateway.h"
#include "server/rpc/limits.h"
#include "server/rpc/server.h"
#include "server/rpc/testing/fleet_credentials.h"
#include "server/rpc/testing/served_map.h"

namespace relmap::rpc {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::minutes kLong{10};

Reason why_of(const grpc::Status& status) {
  v1::Error error;
  EXPECT_TRUE(error.ParseFromString(status.error_details())) << status.error_message();
  return reason_from_wire(error.reason());
}

// A watcher with a connection of its own, who reads when he is asked to.
class Caller {
 public:
  Caller(const std::string& address, const std::shared_ptr<grpc::ChannelCredentials>& by,
         const v1::WatchMapRequest& request = {}, std::optional<std::chrono::milliseconds> deadline = {}) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stub_ = v1::Map::NewStub(grpc::CreateCustomChannel(address, by, arguments));
    if (deadline) context_.set_deadline(std::chrono::system_clock::now() + *deadline);
    reader_ = stub_->WatchMap(&context_, request);
  }
  // Reads until an event that `is`; false at the end of the stream.
  bool read_until(const std::function<bool(const v1::MapEvent&)>& is) {
    v1::MapEvent event;
    while (reader_->Read(&event))
      if (is(event)) return true;
    return false;
  }
  bool catches_up() {
    return read_until([](const v1::MapEvent& event) { return event.has_caught_up(); });
  }
  bool hears_label(const std::string& label) {
    return read_until([&](const v1::MapEvent& event) {
      const auto& labels = event.frame_labels().labels();
      return std::find(labels.begin(), labels.end(), label) != labels.end();
    });
  }
  void cancel() { context_.TryCancel(); }
  grpc::Status finish() {
    read_until([](const v1::MapEvent&) { return false; });
    return reader_->Finish();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::Map::Stub> stub_;
  std::unique_ptr<grpc::ClientReader<v1::MapEvent>> reader_;
};

class Watches : public testing::Test {
 protected:
  void start(RpcLimits limits = {}) {
    commit();
    core_ = std::make_unique<Core>(*map_.mapper, map_.core->facts, limits);
    server_ = RpcServer::start(*core_, everyone_, {.host = "127.0.0.1"}).or_throw();
    address_ = "127.0.0.1:" + std::to_string(server_->port());
  }
  std::unique_ptr<Caller> caller(const v1::WatchMapRequest& request = {},
                                 std::optional<std::chrono::milliseconds> deadline = {}) {
    return std::make_unique<Caller>(address_, grpc::InsecureChannelCredentials(), request, deadline);
  }
  // An edit, which is committed when it returns.
  void label(const std::string& label) {
    const auto stub = v1::Map::NewStub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    v1::SetLabelRequest request;
    *request.mutable_frame() = to_wire(ServedMap::kFirst);
    request.set_label(label);
    v1::SetLabelReply reply;
    const grpc::Status status = stub->SetLabel(&context, request, &reply);
    EXPECT_TRUE(status.ok()) << status.error_message();
    commit();
  }
  void commit() const { EXPECT_TRUE(map_.mapper->commit(std::chrono::steady_clock::now() + kLong).ok()); }
  int running() const { return core_->transport.gateway->running(Gateway::Kind::kWatch); }
  void expect_running(int count) const {
    const auto end = std::chrono::steady_clock::now() + kLong;
    while (running() != count && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    EXPECT_EQ(running(), count);
  }

  const std::int64_t begun_ = now_us();
  ServedMap map_;
  const std::int64_t taken_in_ = now_us();
  const Gatekeeper everyone_{"", true};
  std::unique_ptr<Core> core_;
  std::unique_ptr<RpcServer> server_;
  std::string address_;
};

TEST_F(Watches, ManyWaitOnOneThreadAndAllAreWoken) {
  start({.threads = 1, .max_concurrent = 2});
  std::vector<std::unique_ptr<Caller>> callers;
  for (int i = 0; i < 12; ++i) callers.push_back(caller());
  for (const auto& one : callers) ASSERT_TRUE(one->catches_up());
  EXPECT_EQ(running(), 12);
  label("gate");  // neither kept out by them nor counted with them
  for (const auto& one : callers) EXPECT_TRUE(one->hears_label("gate"));
  EXPECT_EQ(core_->feed.counts().told, 12u);
}

TEST_F(Watches, AWatcherWhoReadsNothingHoldsUpNobody) {
  start({.stalled_s = 0.05});
  const auto asleep = caller(), awake = caller();
  ASSERT_TRUE(awake->catches_up());
  const std::string long_label(60, 'x');
  // More than fits into the windows of the transport, so that the sleeper's message does not leave.
  for (int i = 0; i < 60; ++i) label(std::to_string(i) + long_label);
  EXPECT_TRUE(awake->hears_label("59" + long_label));
  EXPECT_EQ(running(), 2) << "the time within which others must take a message is long over";
  EXPECT_TRUE(asleep->hears_label("59" + long_label)) << "it takes up where it was";
}

TEST_F(Watches, AreAsManyAsTheLimitsSay) {
  start({.max_watchers = 3, .max_watchers_per_caller = 2});
  const auto one = caller(), two = caller();
  ASSERT_TRUE(one->catches_up() && two->catches_up());
  const auto three = caller();
  const grpc::Status refused = three->finish();
  EXPECT_EQ(why_of(refused), Reason::BUDGET_EXCEEDED);
  EXPECT_THAT(refused.error_message(), HasSubstr("2 watches of"));
  one->cancel();
  EXPECT_FALSE(one->finish().ok());
  expect_running(1);
  EXPECT_TRUE(caller()->catches_up());
}

TEST_F(Watches, LeaveRoomForOtherReplies) {
  start();
  const std::size_t share = map_.mapper->budget().allowance(storage::Share::kReplies);
  std::vector<std::unique_ptr<Caller>> callers;
  grpc::Status refused;
  for (int i = 0; i < 64 && refused.ok(); ++i) {
    callers.push_back(caller());
    if (!callers.back()->catches_up()) refused = callers.back()->finish();
  }
  EXPECT_EQ(why_of(refused), Reason::BUDGET_EXCEEDED);
  EXPECT_THAT(refused.error_message(), HasSubstr("open watches use half of the"));
  EXPECT_LE(map_.mapper->budget().used(storage::Share::kReplies), share / 2);
  callers.clear();
  expect_running(0);
}

TEST_F(Watches, OutlastTheDefaultDeadlineAndKeepTheirCallers) {
  start({.default_deadline_s = 0.01});
  const auto lasting = caller(), short_lived = caller({}, std::chrono::milliseconds(700));
  ASSERT_TRUE(lasting->catches_up());
  EXPECT_EQ(short_lived->finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  expect_running(1);
  label("later");
  EXPECT_TRUE(lasting->hears_label("later"));
}

TEST_F(Watches, EndWithTheServerAtOnceAlsoIfTheyReadNothing) {
  start();
  const auto asleep = caller(), awake = caller();
  ASSERT_TRUE(awake->catches_up());
  // More than the sleeper's connection takes in.
  for (int i = 0; i < 60; ++i) label(std::to_string(i) + std::string(60, 'x'));
  ASSERT_TRUE(awake->hears_label("59" + std::string(60, 'x')));
  std::thread stopper([&] { server_->stop(kLong); });
  EXPECT_EQ(why_of(awake->finish()), Reason::SHUTTING_DOWN);
  stopper.join();  // has not waited for its deadline
}

TEST_F(Watches, EndWithTheirCredentials) {
  FleetCredentials fleet;
  const auto anna = fleet.token(Role::kReader, "anna"), robot = fleet.token(Role::kRobot, "cart");
  Gatekeeper gatekeeper(fleet.file("access"));
  ASSERT_TRUE(gatekeeper.reload().ok());
  Core core(*map_.mapper, map_.core->facts);
  const auto server = RpcServer::start(core, gatekeeper, {.host = "127.0.0.1", .tls = fleet.tls()}).or_throw();
  const auto by = [](const access::Credentials& shown) {
    return grpc::CompositeChannelCredentials(grpc::SslCredentials({shown.authorities, "", ""}),
                                             grpc::AccessTokenCredentials(shown.token));
  };
  const std::string address = "localhost:" + std::to_string(server->port());
  Caller reader(address, by(anna)), other(address, by(robot));
  EXPECT_TRUE(reader.catches_up());
  fleet.revoke("anna");
  ASSERT_TRUE(gatekeeper.reload().ok());
  EXPECT_EQ(why_of(reader.finish()), Reason::UNAUTHENTICATED);
  EXPECT_TRUE(other.catches_up()) << "robots may ask what readers may";
  other.cancel();
}

TEST_F(Watches, NameSessionsThatExistAndNotTooMany) {
  start();
  v1::WatchMapRequest request;
  for (int i = 0; i < kMaxNamedSessions; ++i) request.add_sessions(1);
  EXPECT_TRUE(caller(request)->catches_up());
  request.add_sessions(1);
  const grpc::Status too_many = caller(request)->finish();
  EXPECT_EQ(why_of(too_many), Reason::INVALID_ARGUMENT);
  EXPECT_THAT(too_many.error_message(), HasSubstr("more than 10000 sessions"));
  request.clear_sessions();
  request.add_sessions(2);
  request.add_sessions(77);
  const grpc::Status unknown = caller(request)->finish();
  EXPECT_EQ(why_of(unknown), Reason::NO_SUCH_SESSION);
  EXPECT_THAT(unknown.error_message(), HasSubstr("77"));
  request.mutable_sessions()->RemoveLast();
  request.set_from(v1::WATCH_FROM_OLDEST);
  std::string token;
  EXPECT_TRUE(caller(request)->read_until([&](const v1::MapEvent& event) {
    token = event.resume_token();
    return event.has_caught_up();
  }));
  request.add_sessions(77);
  request.set_resume_token(token);
  EXPECT_TRUE(caller(request)->catches_up()) << "it may have been deleted since the token was told";
}

TEST_F(Watches, TellTimesBetweenSubmissionAndCommit) {
  start();
  const std::int64_t labelling = now_us();
  label("first");
  const std::int64_t labelled = now_us();  // and committed
  v1::WatchMapRequest request;
  request.set_from(v1::WATCH_FROM_OLDEST);
  std::int64_t committed = 0;  // when the newest frames were that were told
  int labels = 0, sessions = 0, frames = 0;
  EXPECT_TRUE(caller(request)->read_until([&](const v1::MapEvent& event) {
    if (event.has_storage_changed()) {
      EXPECT_EQ(event.time_us(), 0) << "it is not of the log";
      EXPECT_EQ(event.author(), "");
      return false;
    }
    if (event.has_caught_up()) {
      EXPECT_GE(event.caught_up().time_us(), committed);
      EXPECT_LE(event.caught_up().time_us(), labelled);
      return true;
    }
    EXPECT_GE(event.time_us(), begun_) << event.ShortDebugString();
    EXPECT_LE(event.time_us(), labelled) << event.ShortDebugString();
    if (event.has_frames_added()) {  // when they were committed
      ++frames;
      EXPECT_GE(event.time_us(), committed);
      committed = event.time_us();
    }
    if (event.has_session_changed()) {  // when it was submitted: before the commit of its frames
      ++sessions;
      EXPECT_LE(event.time_us(), taken_in_);
    }
    if (event.has_frame_labels()) {
      ++labels;
      EXPECT_GE(event.time_us(), labelling);
    } else {
      EXPECT_EQ(event.author(), "relmapd") << event.ShortDebugString();
      EXPECT_LE(event.time_us(), labelling) << "all of it is committed";
    }
    return false;
  }));
  EXPECT_EQ(labels, 1);
  EXPECT_EQ(sessions, 2);
  EXPECT_GE(frames, 1);
}

TEST_F(Watches, TellWhoDeletedASession) {
  start();
  v1::DeleteSessionRequest request;
  request.set_session(2);
  request.set_uuid(map_.mapper->view()->session(2)->header.uuid.to_string());
  const std::int64_t begun = now_us();
  {
    const auto stub = v1::Admin::NewStub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    v1::Progress progress;
    const auto deleting = stub->DeleteSession(&context, request);
    while (deleting->Read(&progress)) {
    }
    const grpc::Status status = deleting->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  map_.settle();
  commit();
  const std::int64_t gone = now_us();
  v1::WatchMapRequest from_oldest;
  from_oldest.set_from(v1::WATCH_FROM_OLDEST);
  std::vector<v1::MapEvent> told;
  EXPECT_TRUE(caller(from_oldest)->read_until([&](const v1::MapEvent& event) {
    if (event.has_frames_removed() || event.has_session_deleted()) told.push_back(event);
    return event.has_caught_up();
  }));
  ASSERT_EQ(told.size(), 2u);
  EXPECT_TRUE(told[1].has_session_deleted());
  for (const v1::MapEvent& event : told) {
    EXPECT_EQ(event.author(), access::kAnonymousName);
    EXPECT_GE(event.time_us(), begun);
    EXPECT_LE(event.time_us(), gone);
  }
}

TEST_F(Watches, TellWhoEditedAndGoOnAfterAToken) {
  start();
  label("first");
  v1::WatchMapRequest request;
  request.set_from(v1::WATCH_FROM_OLDEST);
  std::string token;
  {
    const auto watcher = caller(request);
    std::uint64_t frames = 0;
    EXPECT_TRUE(watcher->read_until([&](const v1::MapEvent& event) {
      if (event.has_frames_added()) frames += static_cast<std::uint64_t>(event.frames_added().frames_size());
      if (!event.has_frame_labels()) return false;
      EXPECT_EQ(event.author(), access::kAnonymousName);
      EXPECT_GT(event.time_us(), 0);
      EXPECT_GT(event.journal_sequence(), 0u);
      token = event.resume_token();
      return true;
    }));
    EXPECT_EQ(frames, ServedMap::kFrames + ServedMap::kElsewhere);
    watcher->cancel();
  }
  label("second");
  request.set_resume_token(token);
  const auto again = caller(request);
  int labels = 0;
  EXPECT_TRUE(again->read_until([&](const v1::MapEvent& event) {
    EXPECT_FALSE(event.has_frames_added()) << "that was told before the token";
    labels += event.has_frame_labels();
    return event.has_caught_up();
  }));
  EXPECT_EQ(labels, 1);
  request.set_resume_token("mangled");
  EXPECT_EQ(why_of(caller(request)->finish()), Reason::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace relmap::rpc
