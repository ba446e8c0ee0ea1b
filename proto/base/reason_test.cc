#include "proto/base/reason.h"

#include <gtest/gtest.h>

#include "proto/base/refuse.h"
#include "proto/base/status.h"

namespace relmap {
namespace {

TEST(Reason, NamesAndNumbersGoTogether) {
  EXPECT_EQ(reason_name(Reason::SEQUENCE_CONFLICT), "SEQUENCE_CONFLICT");
  EXPECT_EQ(static_cast<int>(Reason::SEQUENCE_CONFLICT), 8);
  EXPECT_TRUE(is_reason(119));
  EXPECT_FALSE(is_reason(39));
  EXPECT_FALSE(is_reason(65535));
}

TEST(Status, SaysItsReasonFirst) {
  EXPECT_EQ(Status().to_string(), "OK");
  EXPECT_EQ(Status(Reason::TIME_BACKWARDS, "1200 us after 1300 us").to_string(),
            "TIME_BACKWARDS: 1200 us after 1300 us");
}

TEST(Status, IsThrownUnlessItIsOk) {
  EXPECT_NO_THROW(throw_if(Status()));
  try {
    throw_if(Status(Reason::DISK_FULL, "no room"));
    FAIL();
  } catch (const StatusError& e) {
    EXPECT_EQ(e.status().reason(), Reason::DISK_FULL);
    EXPECT_EQ(e.status().message(), "no room");
  }
}

TEST(Status, ARefusalStreamsItsParts) {
  EXPECT_EQ(refuse(Reason::BAD_SIZE, 3, " parts of ", 2.5, " bytes").to_string(), "BAD_SIZE: 3 parts of 2.5 bytes");
}

TEST(Result, OrThrowCarriesTheStatus) {
  EXPECT_EQ(Result<int>(3).or_throw(), 3);
  try {
    Result<int>(Reason::NO_SUCH_FRAME, "9:1").or_throw();
    FAIL();
  } catch (const StatusError& e) {
    EXPECT_EQ(e.status().reason(), Reason::NO_SUCH_FRAME);
  }
}

}  // namespace
}  // namespace relmap
