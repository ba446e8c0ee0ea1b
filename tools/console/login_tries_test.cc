#include "tools/console/login_tries.h"

#include <gtest/gtest.h>

#include <string>

namespace relmap::console {
namespace {

using std::chrono::seconds;

const LoginTries::Clock::time_point kTriesStart{seconds(100'000)};

std::string hash_of(int what) { return "hash " + std::to_string(what); }

TEST(LoginTries, AreLimitedForEachAddress) {
  LoginTries tries;
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(tries.begin("10.0.0.1", hash_of(i), kTriesStart).ok()) << i;
  EXPECT_EQ(tries.begin("10.0.0.1", hash_of(10), kTriesStart).reason(), Reason::RATE_LIMITED);
  EXPECT_TRUE(tries.begin("10.0.0.2", hash_of(10), kTriesStart).ok());
  EXPECT_EQ(tries.begin("10.0.0.1", hash_of(10), kTriesStart + seconds(59)).reason(), Reason::RATE_LIMITED);
  EXPECT_TRUE(tries.begin("10.0.0.1", hash_of(10), kTriesStart + seconds(61)).ok());
}

TEST(LoginTries, CountTheSameOnceAndSuccessNotAtAll) {
  LoginTries tries;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(tries.begin("10.0.0.1", hash_of(1), kTriesStart).ok());
  for (int i = 2; i < 1000; ++i) {
    EXPECT_TRUE(tries.begin("10.0.0.1", hash_of(i), kTriesStart).ok());
    tries.succeeded("10.0.0.1", hash_of(i));
  }
  EXPECT_EQ(tries.addresses(), 1u);
  tries.succeeded("10.0.0.1", hash_of(1));
  EXPECT_EQ(tries.addresses(), 0u);
}

TEST(LoginTries, CountAllAddressesOfANetworkOfIpv6AsOne) {
  EXPECT_EQ(network_of("10.1.2.3"), "10.1.2.3");
  EXPECT_EQ(network_of("::ffff:10.1.2.3"), "10.1.2.3");
  EXPECT_EQ(network_of("2001:db8:1:2:3:4:5:6"), network_of("2001:db8:1:2::1"));
  EXPECT_NE(network_of("2001:db8:1:2::1"), network_of("2001:db8:1:3::1"));
  LoginTries tries;
  for (int i = 0; i < 10; ++i)
    EXPECT_TRUE(tries.begin("2001:db8::" + std::to_string(i + 1), hash_of(i), kTriesStart).ok());
  EXPECT_EQ(tries.begin("2001:db8::ffff", hash_of(10), kTriesStart).reason(), Reason::RATE_LIMITED);
}

TEST(LoginTries, KeepAtMostSoManyAddresses) {
  LoginTries tries;
  constexpr int kMore = 500;
  for (int i = 0; i < static_cast<int>(LoginTries::kMaxAddresses) + kMore; ++i) {
    const std::string address =
        "10." + std::to_string(i >> 16) + "." + std::to_string((i >> 8) & 255) + "." + std::to_string(i & 255);
    ASSERT_TRUE(tries.begin(address, hash_of(1), kTriesStart + std::chrono::milliseconds(i)).ok());
  }
  EXPECT_EQ(tries.addresses(), LoginTries::kMaxAddresses);
}

}  // namespace
}  // namespace relmap::console
