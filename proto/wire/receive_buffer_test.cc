#include "proto/wire/receive_buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace relmap {
namespace {

using testing::HasSubstr;

const std::string kGroup = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=";

TEST(ReceiveBuffer, GivesNoAdviceIfTheSizeIsGranted) {
  EXPECT_EQ(receive_buffer_advice(kGroup + "4096"), "");
  EXPECT_EQ(receive_buffer_advice("udpm://239.255.76.67:7667?ttl=0"), "") << "nothing is asked for";
  EXPECT_EQ(receive_buffer_advice("memq://"), "");
  EXPECT_EQ(receive_buffer_advice("no url"), "");
}

TEST(ReceiveBuffer, AdvisesTheCommandThatRaisesTheLimit) {
  long long max_bytes = 0;
  if (!(std::ifstream("/proc/sys/net/core/rmem_max") >> max_bytes) || max_bytes >= 1'000'000'000)
    GTEST_SKIP() << "the system does not say what it grants, or grants everything";
  const std::string advice = receive_buffer_advice(kGroup + "1000000000");
  EXPECT_THAT(advice, HasSubstr("of " + std::to_string(max_bytes) + " bytes of the 1000000000 asked for"));
  EXPECT_THAT(advice, HasSubstr("sysctl -w net.core.rmem_max=1000000000"));
}

}  // namespace
}  // namespace relmap
