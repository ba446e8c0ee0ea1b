#include "client/rpc_error.h"

#include <gmock/gmock.h>
#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include "relmap/v1/reason.pb.h"

namespace relmap::client {
namespace {

using ::testing::HasSubstr;

Status told(grpc::StatusCode code, int reason) {
  v1::Error error;
  error.set_reason(static_cast<v1::Reason>(reason));
  error.set_message("why");
  return status_of({code, "why", error.SerializeAsString()});
}

TEST(RpcError, AKnownReasonIsTold) {
  EXPECT_EQ(told(grpc::StatusCode::NOT_FOUND, v1::REASON_NO_SUCH_FRAME).to_string(), "NO_SUCH_FRAME: why");
}

TEST(RpcError, AReasonOfALaterVersionBecomesTheNearestThatItsCodeNames) {
  constexpr int kLater = 9999;
  EXPECT_EQ(told(grpc::StatusCode::INVALID_ARGUMENT, kLater).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(told(grpc::StatusCode::PERMISSION_DENIED, kLater).reason(), Reason::NOT_ALLOWED);
  EXPECT_EQ(told(grpc::StatusCode::DATA_LOSS, kLater).reason(), Reason::DATA_LOSS);
  EXPECT_EQ(told(grpc::StatusCode::NOT_FOUND, kLater).reason(), Reason::INTERNAL);
  EXPECT_EQ(told(grpc::StatusCode::UNAVAILABLE, kLater).reason(), Reason::INTERNAL) << "a daemon has answered";
  EXPECT_THAT(told(grpc::StatusCode::NOT_FOUND, kLater).message(), HasSubstr("why (reason 9999 of a newer relmapd)"));
}

TEST(RpcError, WithoutAReasonTheCodeDecides) {
  EXPECT_EQ(status_of({grpc::StatusCode::UNAVAILABLE, "gone"}).reason(), Reason::UNREACHABLE);
  EXPECT_TRUE(status_of(grpc::Status()).ok());
}

}  // namespace
}  // namespace relmap::client
