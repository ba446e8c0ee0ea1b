#include "server/rpc/gatekeeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/rpc/testing/fleet_credentials.h"

namespace relmap::rpc {
namespace {

using Way = Evidence::Way;
using testing::HasSubstr;

Status why(const Result<Identity>& identity) { return identity.status(); }

TEST(Gatekeeper, TheSocketIsForOperators) {
  const auto identity = Gatekeeper().identify({Way::kSocket, {}, {}});
  ASSERT_TRUE(identity.ok()) << identity.status().to_string();
  EXPECT_EQ(identity->role, Role::kOperator);
  EXPECT_EQ(identity->robot(), "");
}

TEST(Gatekeeper, TcpWithoutTlsIsForNobodyUnlessTheConfigurationSaysSo) {
  EXPECT_EQ(Gatekeeper().identify({}).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(Gatekeeper("", true).identify({}).or_throw().role, Role::kOperator);
}

TEST(Gatekeeper, TlsAloneProvesNothing) {
  const Gatekeeper open("", true);
  const Status nobody = why(open.identify({Way::kTls, {}, {}}));
  EXPECT_EQ(nobody.reason(), Reason::UNAUTHENTICATED);
  EXPECT_THAT(nobody.message(), HasSubstr("neither"));
  EXPECT_EQ(open.identify({Way::kTls, {}, "a guess"}).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(open.identify({Way::kTls, "no certificate", {}}).reason(), Reason::UNAUTHENTICATED);
}

TEST(Gatekeeper, ACertificateNamesItsOwner) {
  FleetCredentials fleet;
  const access::Credentials cart = fleet.certificate(Role::kRobot, "cart 1");
  const auto identity = Gatekeeper().identify({Way::kTls, cart.certificate, {}});
  ASSERT_TRUE(identity.ok()) << identity.status().to_string();
  EXPECT_EQ(identity->role, Role::kRobot);
  EXPECT_EQ(identity->robot(), "cart 1");
  // The daemon's own certificate is signed by the same authority, and lets nobody in.
  const auto daemon = access::issue(fleet.authority(), {"relmapd", {"localhost"}, {}, 1}).or_throw();
  EXPECT_EQ(Gatekeeper().identify({Way::kTls, daemon.certificate, {}}).reason(), Reason::UNAUTHENTICATED);
}

TEST(Gatekeeper, TokensAreKnownByTheListAndDecideBeforeCertificates) {
  FleetCredentials fleet;
  const access::Credentials reader = fleet.token(Role::kReader, "dashboard");
  const access::Credentials late = fleet.token(Role::kReader, "late", 1);
  const access::Credentials boss = fleet.certificate(Role::kOperator, "boss");
  Gatekeeper gatekeeper(fleet.file("access"));
  EXPECT_EQ(gatekeeper.identify({Way::kTls, {}, reader.token}).reason(), Reason::UNAUTHENTICATED) << "not read yet";
  ASSERT_TRUE(gatekeeper.reload().ok());
  EXPECT_EQ(gatekeeper.identify({Way::kTls, {}, reader.token}).or_throw().role, Role::kReader);
  EXPECT_EQ(gatekeeper.identify({Way::kTls, boss.certificate, reader.token}).or_throw().role, Role::kReader);
  EXPECT_EQ(gatekeeper.identify({Way::kTls, boss.certificate, "wrong"}).reason(), Reason::UNAUTHENTICATED);
  EXPECT_THAT(why(gatekeeper.identify({Way::kTls, {}, late.token})).message(), HasSubstr("expired at 1970"));
  EXPECT_EQ(gatekeeper.identify({Way::kTls, {}, access::sha256(reader.token)}).reason(), Reason::UNAUTHENTICATED)
      << "what is in the list must let nobody in";
  // A certificate of the list is no token, and the other way round.
  EXPECT_EQ(gatekeeper.identify({Way::kTls, {}, boss.certificate}).reason(), Reason::UNAUTHENTICATED);
}

TEST(Gatekeeper, WhatIsRevokedEndsWithTheNextReload) {
  FleetCredentials fleet;
  const access::Credentials cart = fleet.certificate(Role::kRobot, "cart"), dash = fleet.token(Role::kReader, "dash");
  Gatekeeper gatekeeper(fleet.file("access"));
  ASSERT_TRUE(gatekeeper.reload_if_changed().ok());
  const Identity before = gatekeeper.identify({Way::kTls, cart.certificate, {}}).or_throw();
  EXPECT_TRUE(gatekeeper.is_current(before));
  ASSERT_TRUE(gatekeeper.reload_if_changed().ok());
  EXPECT_TRUE(gatekeeper.is_current(before)) << "nothing has changed";
  fleet.revoke("cart");
  fleet.revoke("dash");
  ASSERT_TRUE(gatekeeper.reload_if_changed().ok());
  EXPECT_FALSE(gatekeeper.is_current(before));
  EXPECT_THAT(why(gatekeeper.identify({Way::kTls, cart.certificate, {}})).message(), HasSubstr("revoked"));
  EXPECT_THAT(why(gatekeeper.identify({Way::kTls, {}, dash.token})).message(), HasSubstr("revoked"));
}

TEST(Gatekeeper, AListThatCannotBeReadChangesNothing) {
  FleetCredentials fleet;
  const access::Credentials dash = fleet.token(Role::kReader, "dash");
  Gatekeeper gatekeeper(fleet.file("access"));
  ASSERT_TRUE(gatekeeper.reload().ok());
  fleet.write("access", "token of cart-1\n");
  EXPECT_EQ(gatekeeper.reload_if_changed().reason(), Reason::BAD_CONFIG);
  EXPECT_EQ(gatekeeper.reload_if_changed().reason(), Reason::BAD_CONFIG) << "it is tried again";
  fleet.write("access", "");
  EXPECT_EQ(gatekeeper.reload_if_changed().reason(), Reason::BAD_CONFIG) << "what was cut short revokes nothing";
  EXPECT_EQ(gatekeeper.identify({Way::kTls, {}, dash.token}).or_throw().name, "dash");
  EXPECT_EQ(Gatekeeper(fleet.file("")).reload().reason(), Reason::IO_ERROR) << "a folder";
  EXPECT_EQ(Gatekeeper(fleet.file("nowhere")).reload().reason(), Reason::NO_SUCH_FILE);
}

TEST(Gatekeeper, AnIdentityEndsWhenItsCredentialsExpire) {
  Identity identity;
  identity.expires_s = 1;
  EXPECT_FALSE(Gatekeeper().is_current(identity));
}

}  // namespace
}  // namespace relmap::rpc
