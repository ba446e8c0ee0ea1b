#include "server/rpc/request_context.h"

#include <gtest/gtest.h>

#include <thread>

namespace relmap::rpc {
namespace {

constexpr char kGood[] = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

TEST(RequestContext, TakesOnlyWhatIsATraceparent) {
  EXPECT_EQ(checked_traceparent(kGood), kGood);
  const RequestContext context{"id", kGood};
  EXPECT_EQ(context.trace_id(), "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(RequestContext().trace_id(), "");
  for (const char* bad : {"", "00", "01-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
                          "00-4bf92f3577b34da6a3ce929d0e0e473-00f067aa0ba902b7-010",
                          "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
                          "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
                          "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
                          "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-0\n",
                          "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more"})
    EXPECT_EQ(checked_traceparent(bad), "") << bad;
}

TEST(RequestContext, BelongsToTheThreadThatWorksForIt) {
  EXPECT_EQ(current_request(), nullptr);
  const RequestContext outer{"outer", ""}, inner{"inner", ""};
  {
    const RequestScope scope(outer);
    EXPECT_EQ(current_request(), &outer);
    {
      const RequestScope within(inner);
      EXPECT_EQ(current_request(), &inner);
      std::thread([] { EXPECT_EQ(current_request(), nullptr); }).join();
    }
    EXPECT_EQ(current_request(), &outer);
  }
  EXPECT_EQ(current_request(), nullptr);
}

}  // namespace
}  // namespace relmap::rpc
