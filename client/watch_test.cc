// Client::watch() against daemons whose streams the test writes.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>
#include <vector>

#include "client/relmap_client.h"
#include "proto/base/mutex.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.grpc.pb.h"

namespace relmap::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

grpc::Status ended(Reason reason, grpc::StatusCode code) {
  v1::Error error;
  error.set_reason(to_wire(reason));
  error.set_message("it ended");
  return {code, "it ended", error.SerializeAsString()};
}

v1::MapEvent caught_up(std::uint64_t sequence, const std::string& token) {
  v1::MapEvent event;
  event.mutable_caught_up()->set_journal_sequence(sequence);
  event.set_resume_token(token);
  return event;
}

// What a stream tells, and how it ends.
struct Stream {
  std::vector<v1::MapEvent> events;
  grpc::Status end;
  bool hangs = false;  // after the events, until its caller goes
};

class WatchedMap final : public v1::Map::Service {
 public:
  explicit WatchedMap(std::vector<Stream> streams) : streams_(std::move(streams)) {}

  grpc::Status WatchMap(grpc::ServerContext* context, const v1::WatchMapRequest* request,
                        grpc::ServerWriter<v1::MapEvent>* writer) override {
    Stream stream;
    {
      const MutexLock lock(mutex_);
      requests_.push_back(*request);
      stream = streams_.at(std::min(requests_.size(), streams_.size()) - 1);
    }
    for (const v1::MapEvent& event : stream.events) writer->Write(event);
    while (stream.hangs && !context->IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return stream.end;
  }
  std::vector<v1::WatchMapRequest> requests() {
    const MutexLock lock(mutex_);
    return requests_;
  }

 private:
  Mutex mutex_;
  const std::vector<Stream> streams_;
  std::vector<v1::WatchMapRequest> requests_ RELMAP_GUARDED_BY(mutex_);
};

class WatchTest : public ::testing::Test {
 protected:
  ~WatchTest() override {
    if (server_) server_->Shutdown();
    std::filesystem::remove(socket_);
  }
  void serve(std::vector<Stream> streams) {
    map_ = std::make_unique<WatchedMap>(std::move(streams));
    grpc::ServerBuilder builder;
    builder.AddListeningPort("unix:" + socket_, grpc::InsecureServerCredentials());
    builder.RegisterService(map_.get());
    server_ = builder.BuildAndStart();
    ASSERT_TRUE(server_);
    client_ = Client::connect("unix:" + socket_).or_throw();
  }
  // Watches until `enough` events of the stream came. "5": caught up to there; "+", "-": connected, disconnected.
  Status watch(WatchOptions options, std::size_t enough) {
    return client_->watch(options, [&](const WatchEvent& event) {
      if (const auto* caught = std::get_if<CaughtUp>(&event.what))
        heard_.push_back(std::to_string(caught->journal_sequence));
      else if (std::holds_alternative<WatchConnected>(event.what))
        heard_.push_back("+");
      else if (const auto* gone = std::get_if<WatchDisconnected>(&event.what))
        heard_.push_back("-"), why_ = gone->why;
      const auto told = std::count_if(heard_.begin(), heard_.end(), [](const auto& one) { return one > "0"; });
      return static_cast<std::size_t>(told) < enough ? Status() : Status(Reason::OUT_OF_REACH, "enough");
    });
  }

  const std::string socket_ =
      (std::filesystem::temp_directory_path() / ("relmap-watch-" + std::to_string(getpid()))).string();
  std::unique_ptr<WatchedMap> map_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Client> client_;
  std::vector<std::string> heard_;
  Status why_;
};

TEST_F(WatchTest, GoesOnAfterTheLastEventUntilTheSinkFails) {
  serve({{{caught_up(5, "five"), caught_up(6, "six")}, ended(Reason::SHUTTING_DOWN, grpc::StatusCode::UNAVAILABLE)},
         {{caught_up(7, "seven")}, {}, true}});
  WatchOptions options;
  options.sessions = {3};
  options.from = WatchOptions::From::kOldest;
  options.no_frames = true;
  EXPECT_EQ(watch(options, 3).reason(), Reason::OUT_OF_REACH);
  EXPECT_THAT(heard_, ElementsAre("+", "5", "6", "-", "+", "7"));
  EXPECT_EQ(why_.reason(), Reason::SHUTTING_DOWN);
  const auto requests = map_->requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].from(), v1::WATCH_FROM_OLDEST);
  EXPECT_TRUE(requests[0].no_frames());
  EXPECT_EQ(requests[0].resume_token(), "");
  EXPECT_EQ(requests[1].resume_token(), "six");
  EXPECT_EQ(requests[1].sessions(0), 3u);
}

TEST_F(WatchTest, AConnectionOverWhichNothingComesIsDead) {
  serve({{{caught_up(5, "five")}, {}, true}});
  WatchOptions options;
  options.dead_after = std::chrono::milliseconds(200);
  EXPECT_EQ(watch(options, 2).reason(), Reason::OUT_OF_REACH);
  EXPECT_THAT(heard_, ElementsAre("+", "5", "-", "+", "5"));
  EXPECT_EQ(why_.reason(), Reason::UNREACHABLE);
  EXPECT_THAT(why_.message(), HasSubstr("the connection is dead"));
}

TEST_F(WatchTest, WhatNoOtherDaemonWouldAnswerOtherwiseEndsIt) {
  serve({{{}, ended(Reason::INVALID_ARGUMENT, grpc::StatusCode::INVALID_ARGUMENT)},
         {{}, ended(Reason::NO_SUCH_SESSION, grpc::StatusCode::NOT_FOUND)}});
  EXPECT_EQ(watch({}, 1).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(map_->requests().size(), 1u);
  EXPECT_EQ(watch({}, 1).reason(), Reason::NO_SUCH_SESSION);
  EXPECT_EQ(map_->requests().size(), 2u);
  EXPECT_TRUE(heard_.empty());
}

TEST_F(WatchTest, WithoutReconnectionItEndsWithTheReason) {
  serve({{{caught_up(5, "five")}, ended(Reason::SHUTTING_DOWN, grpc::StatusCode::UNAVAILABLE)}});
  WatchOptions options;
  options.reconnect = false;
  EXPECT_EQ(watch(options, 9).reason(), Reason::SHUTTING_DOWN);
  EXPECT_THAT(heard_, ElementsAre("+", "5"));
}

TEST_F(WatchTest, IsStoppedWhileNothingHappensAndWhileNobodyAnswers) {
  serve({{{caught_up(5, "five")}, {}, true}});
  std::atomic<bool> stop = false;
  WatchOptions options;
  options.stopped = [&] { return stop.load(); };
  std::thread stopper([&] {
    while (map_->requests().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    stop = true;
  });
  EXPECT_TRUE(watch(options, 9).ok());
  stopper.join();
  server_->Shutdown();
  server_.reset();
  stop = false;
  options.stopped = [&] { return !why_.ok(); };
  EXPECT_TRUE(watch(options, 9).ok());
  EXPECT_EQ(why_.reason(), Reason::UNREACHABLE);
}

TEST_F(WatchTest, AnEventOfALaterVersionIsLeftOutAndAnIllFormedOneEndsIt) {
  v1::MapEvent later, broken;
  later.set_resume_token("later");
  broken.mutable_edge_changed()->mutable_a_from_b()->mutable_rotation()->set_w(7);
  serve({{{later, caught_up(5, "five"), broken}, {}, true}});
  EXPECT_EQ(watch({}, 9).reason(), Reason::CORRUPT);
  EXPECT_THAT(heard_, ElementsAre("+", "5"));
}

}  // namespace
}  // namespace relmap::client
