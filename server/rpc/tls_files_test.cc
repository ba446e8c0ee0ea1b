#include "server/rpc/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/rpc/testing/fleet_credentials.h"

namespace relmap::rpc {
namespace {

using ::testing::HasSubstr;

TEST(TlsFiles, AreWatchedUntilTheirCertificateExpires) {
  const FleetCredentials fleet;
  const access::KeyPair authority = access::new_authority("fleet", 300);
  const auto server = access::issue(authority, {"relmapd", {"localhost"}, {}, 100}).or_throw();
  fleet.write("ca.crt", authority.certificate);
  fleet.write("server.pem", server.key + server.certificate);
  const std::int64_t expires = access::read_certificate(server.certificate).or_throw().expires_s, day = 86'400;
  EXPECT_TRUE(tls_state(fleet.tls(), expires - 15 * day).ok());
  EXPECT_THAT(
      tls_state(fleet.tls(), expires - 13 * day).to_string(),
      AllOf(HasSubstr("BAD_CONFIG: "), HasSubstr("server.pem expires at "), HasSubstr("relmap-admin credentials ca")));
  EXPECT_THAT(tls_state(fleet.tls(), expires).message(), HasSubstr("and nobody can call over TLS"));
  const std::int64_t last = access::read_certificate(authority.certificate).or_throw().expires_s;
  fleet.write("server.pem", [&] {
    const auto later = access::issue(authority, {"relmapd", {"localhost"}, {}, 400}).or_throw();
    return later.key + later.certificate;
  }());
  EXPECT_THAT(tls_state(fleet.tls(), last).message(), HasSubstr("ca.crt expired at ")) << "nor can callers, then";
  fleet.write("server.pem", server.key + server.certificate);
  EXPECT_TRUE(check_files(fleet.tls()).ok()) << "a daemon starts with it: robots send over LCM, too";
  fleet.write("server.pem", "no certificate");
  EXPECT_EQ(tls_state(fleet.tls(), 0).reason(), Reason::BAD_CONFIG);
  EXPECT_TRUE(tls_state({}, 0).ok()) << "without TLS";
  TlsWatch watch(fleet.tls());
  EXPECT_TRUE(watch.state().ok());
  EXPECT_EQ(watch.look(0).reason(), Reason::BAD_CONFIG);
  EXPECT_EQ(watch.state().reason(), Reason::BAD_CONFIG);
}

}  // namespace
}  // namespace relmap::rpc
