#include "tools/console/http/origin.h"

#include <gtest/gtest.h>

#include <string>

namespace relmap::console {
namespace {

TEST(HostName, ReadsNamesAddressesAndPorts) {
  EXPECT_EQ(*parse_host("Map.Lab:8086"), (HostName{"map.lab", "8086"}));
  EXPECT_EQ(*parse_host("map.lab"), (HostName{"map.lab", ""}));
  EXPECT_EQ(*parse_host("map.lab."), (HostName{"map.lab", ""}));
  EXPECT_EQ(*parse_host("[::1]:8086"), (HostName{"::1", "8086"}));
  EXPECT_EQ(*parse_host("[::1]"), (HostName{"::1", ""}));
  for (const std::string bad : {"", ":80", "a b", "a:", "a:b", "a:123456", "[::1", "[]", "[::1]8086", "[evil]:1", "a/b",
                                "user@host", "a,b", "a\"b"})
    EXPECT_EQ(parse_host(bad).reason(), Reason::INVALID_ARGUMENT) << bad;
}

class OwnNamesTest : public ::testing::Test {
 protected:
  const OwnNames names_{{"localhost", "127.0.0.1", "::1"}, {*parse_host("console.lab"), *parse_host("other.lab:8443")}};
};

// DNS rebinding: a page of evil.example whose name leads to this machine for now still says whose it is.
TEST_F(OwnNamesTest, RefuseWhoeverAsksByAnotherName) {
  for (const std::string own : {"localhost:8086", "LOCALHOST", "127.0.0.1:9", "[::1]:8086", "console.lab", "other.lab",
                                "console.lab:8443", "10.0.0.5:8086"})
    EXPECT_TRUE(names_.check_host(own, "10.0.0.5").ok()) << own;
  for (const std::string other :
       {"evil.example:8086", "10.0.0.6", "localhost.evil.example", "evil-console.lab", "127.0.0.1.evil.example"})
    EXPECT_EQ(names_.check_host(other, "10.0.0.5").reason(), Reason::NOT_ALLOWED) << other;
  EXPECT_EQ(names_.check_host("", "10.0.0.5").reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(OwnNamesTest, RefusePostsOfOtherOrigins) {
  const std::string host = "localhost:8086";
  EXPECT_TRUE(names_.check_origin("http://localhost:8086", host, false).ok());
  EXPECT_TRUE(names_.check_origin("https://console.lab", host, false).ok()) << "through a proxy";
  EXPECT_TRUE(names_.check_origin("https://console.lab:443", host, false).ok());
  EXPECT_TRUE(names_.check_origin("https://other.lab:8443", host, false).ok());
  for (const std::string other :
       {"", "null", "http://localhost", "http://localhost:8087", "http://127.0.0.1:8086", "https://evil.example",
        "http://localhost:8086.evil.example", "file://localhost:8086", "https://console.lab:8443", "https://other.lab",
        "http://localhost:8086/", "http://user@localhost:8086", "localhost:8086"})
    EXPECT_EQ(names_.check_origin(other, host, false).reason(), Reason::NOT_ALLOWED) << other;
}

TEST_F(OwnNamesTest, AskForHttpsOverTls) {
  EXPECT_TRUE(names_.check_origin("https://localhost:8443", "localhost:8443", true).ok());
  EXPECT_TRUE(names_.check_origin("https://localhost", "localhost:443", true).ok());
  EXPECT_EQ(names_.check_origin("http://localhost:8443", "localhost:8443", true).reason(), Reason::NOT_ALLOWED);
}

}  // namespace
}  // namespace relmap::console
