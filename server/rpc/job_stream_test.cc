#include "server/rpc/job_stream.h"

#include <gtest/gtest.h>

#include <atomic>
#include <string>

namespace relmap::rpc {
namespace {

using Stream = JobStream<std::string>;

class JobStreamTest : public testing::Test {
 protected:
  // All messages, and how the stream ended.
  static std::pair<std::vector<std::string>, Status> read(Stream& stream) {
    std::vector<std::string> messages;
    for (;;) {
      auto next = stream.take();
      if (!next.ok()) return {messages, next.status()};
      if (!next->has_value()) return {messages, {}};
      messages.push_back(**next);
    }
  }

  MaintenanceTurn turn_;
  Deadline deadline_;
};

TEST_F(JobStreamTest, DeliversMessagesInOrderToASlowReader) {
  Stream stream(turn_.take("counting").value(), deadline_, [](Stream& out) -> Status {
    for (int i = 0; i < 100; ++i) out.send(std::to_string(i));
    return {};
  });
  const auto [messages, end] = read(stream);
  EXPECT_TRUE(end.ok());
  ASSERT_EQ(messages.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(messages[static_cast<std::size_t>(i)], std::to_string(i));
}

TEST_F(JobStreamTest, ReportsProgressWhileNothingIsSent) {
  std::atomic<bool> go_on{false};
  Stream stream(turn_.take("waiting").value(), deadline_, [&](Stream& out) -> Status {
    out.show("half way");
    while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return {Reason::IO_ERROR, "the end"};
  });
  EXPECT_EQ(**stream.take(), "half way");
  go_on = true;
  EXPECT_EQ(read(stream).second.reason(), Reason::IO_ERROR);
}

TEST_F(JobStreamTest, EndsTheJobWhenItsReaderIsGone) {
  std::atomic<bool> told{false};
  {
    Stream stream(turn_.take("for ever").value(), deadline_, [&](Stream& out) -> Status {
      Status status;
      for (; status.ok(); status = out.check()) out.send("more");
      told = true;
      return status;
    });
    EXPECT_EQ(**stream.take(), "more");
  }
  EXPECT_TRUE(told);
}

TEST_F(JobStreamTest, AJobThatThrowsEndsOnlyItself) {
  Stream stream(turn_.take("failing").value(), deadline_,
                [](Stream&) -> Status { throw StatusError(Status(Reason::DATA_LOSS, "a part")); });
  EXPECT_EQ(read(stream).second.reason(), Reason::DATA_LOSS);
}

TEST(MaintenanceTurn, IsHeldByOneAndNamedToOthers) {
  MaintenanceTurn turn;
  {
    const auto held = turn.take("Admin.Verify");
    ASSERT_TRUE(held.ok());
    const auto second = turn.take("Admin.Backup");
    EXPECT_EQ(second.reason(), Reason::BUDGET_EXCEEDED);
    EXPECT_NE(second.status().message().find("Admin.Verify"), std::string::npos);
  }
  EXPECT_TRUE(turn.take("Admin.Backup").ok());
}

}  // namespace
}  // namespace relmap::rpc
