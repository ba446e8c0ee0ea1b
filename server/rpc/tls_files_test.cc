#include "server/rpc/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/rpc/testing/fleet_credentials.h"

namespace relmap::rpc {
namespace {

using ::testing::HasSubstr;

TEST(TlsFiles, AreWatchedUntilTheirCertificateExpires) {
  const FleetCredentials fleet;
  const auto server = access::issue(fleet.authority(), {"relmapd", {"localhost"}, {}, 100}).or_throw();
  fleet.write("server.pem", server.key + server.certificate);
  const std::int64_t expires = access::read_certificate(server.certificate).or_throw().expires_s, day = 86'400;
  EXPECT_TRUE(tls_state(fleet.tls(), expires - 15 * day).ok());
  EXPECT_THAT(
      tls_state(fleet.tls(), expires - 13 * day).to_string(),
      AllOf(HasSubstr("BAD_CONFIG: "), HasSubstr("server.pem expires at "), HasSubstr("credentials ca FOLDER")));
  EXPECT_THAT(tls_state(fleet.tls(), expires).message(), HasSubstr("and nobody can call over TLS"));
  EXPECT_TRUE(check_files(fleet.tls()).ok()) << "a daemon starts with it: robots send over LCM, too";
  fleet.write("server.pem", "no certificate");
  EXPECT_EQ(tls_state(fleet.tls(), 0).reason(), Reason::BAD_CONFIG);
  EXPECT_TRUE(tls_state({}, 0).ok()) << "without TLS";
}

}  // namespace
}  // namespace relmap::rpc
