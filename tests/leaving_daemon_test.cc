// A daemon that goes away during a command: relmap ends, and reports why as text and as JSON.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>

#include "proto/wire/convert.h"
#include "relmap/v1/map.grpc.pb.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

grpc::Status refusal(Reason reason, const std::string& message) {
  v1::Error error;
  error.set_reason(to_wire(reason));
  error.set_message(message);
  return {grpc::StatusCode::UNAVAILABLE, message, error.SerializeAsString()};
}

// A daemon that answers once, and then hangs while it stops.
class StoppingMap final : public v1::Map::Service {
 public:
  grpc::Status GetStatus(grpc::ServerContext*, const v1::GetStatusRequest*, v1::GetStatusReply*) override {
    return asked_++ == 0 ? grpc::Status::OK : refusal(Reason::SHUTTING_DOWN, "the daemon is stopping");
  }
  grpc::Status ListSessions(grpc::ServerContext*, const v1::ListSessionsRequest*, v1::ListSessionsReply*) override {
    return grpc::Status::OK;
  }
  grpc::Status Localise(grpc::ServerContext*, const v1::LocaliseRequest* request, v1::LocaliseReply*) override {
    if (request->view().frame().session() == 1) return refusal(Reason::SHUTTING_DOWN, "the daemon is stopping");
    return {grpc::StatusCode::UNAVAILABLE, "gone"};
  }

 private:
  std::atomic<int> asked_ = 0;
};

class LeavingDaemon : public ::testing::Test {
 protected:
  LeavingDaemon() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&map_);
    server_ = builder.BuildAndStart();
  }
  ~LeavingDaemon() override { server_->Shutdown(); }

  Finished relmap(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(),
                     {built_program("relmap"), "--server", "127.0.0.1:" + std::to_string(port_), "--json"});
    return run_program(arguments);
  }

  StoppingMap map_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(LeavingDaemon, OneThatHangsWhileStoppingIsNotAwaitedForEver) {
  const storage::TemporaryFolder folder;
  setenv("XDG_STATE_HOME", (folder / "state").c_str(), 1);
  const Finished ended = relmap({"ingest", folder / "nowhere", "--patience", "1"});
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_THAT(ended.standard_error, HasSubstr("SHUTTING_DOWN: the daemon is stopping; waiting for it"));
  EXPECT_THAT(ended.standard_error, HasSubstr("1 of 1 recordings failed"));
}

TEST_F(LeavingDaemon, ARefusalIsAJsonObjectWithTheExitCodeOfItsReason) {
  const Finished stopping = relmap({"localise", "1:0"});
  EXPECT_EQ(stopping.exit_code, 1);
  EXPECT_THAT(stopping.standard_output, StartsWith(R"({"error":{"reason":"SHUTTING_DOWN","message":")"));
  const Finished gone = relmap({"localise", "2:0"});
  EXPECT_EQ(gone.exit_code, 3);
  EXPECT_THAT(gone.standard_output, StartsWith(R"({"error":{"reason":"UNREACHABLE","message":")"));
}

}  // namespace
}  // namespace relmap::testing
