#include "server/rpc/ingest_messages.h"

#include <gtest/gtest.h>

namespace relmap::rpc {
namespace {

TEST(AcknowledgementMessage, SaysWhatTheReasonOfARefusalMeans) {
  Acknowledgement ack;
  ack.refused = {{7, 0x1234, Reason::TIME_AHEAD}};
  const v1::Acknowledgement message = acknowledgement_message(ack);
  ASSERT_EQ(message.refused_size(), 1);
  EXPECT_EQ(message.refused(0).sequence(), 7u);
  EXPECT_EQ(message.refused(0).reason(), v1::REASON_TIME_AHEAD);
  EXPECT_EQ(message.refused(0).message(), "its time is more than a day ahead of the server's clock");
}

}  // namespace
}  // namespace relmap::rpc
