#include "proto/access/access_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/access/token.h"

namespace relmap::access {
namespace {

using testing::HasSubstr;

const std::string kHash(64, 'a'), kOther(64, 'b');

TEST(AccessList, IsReadAsItWasWritten) {
  AccessList list;
  list.add({Grant::Kind::kToken, kHash, {Role::kReader, "dash board"}, 1'827'446'400, false});
  list.add({Grant::Kind::kCertificate, kOther, {Role::kRobot, "Wägelchen"}, 0, true});
  list.add({Grant::Kind::kKey, std::string(64, 'c'), {Role::kRobot, "Wägelchen"}, 0, false});
  const auto again = AccessList::parse(list.text(), "file");
  ASSERT_TRUE(again.ok()) << again.status().to_string();
  EXPECT_EQ(again->grants(), list.grants());
  EXPECT_EQ(again->text(), list.text());
  EXPECT_THAT(list.text(), HasSubstr("token " + kHash + " reader 2027-11-29T00:00:00Z valid dash board\n"));
  EXPECT_EQ(again->find(Grant::Kind::kToken, kHash)->principal.name, "dash board");
  EXPECT_FALSE(again->find(Grant::Kind::kCertificate, kHash));
  EXPECT_FALSE(again->find(Grant::Kind::kToken, kHash.substr(1)));
}

TEST(AccessList, CommentsAndEmptyLinesAreLeftOut) {
  EXPECT_TRUE(AccessList::parse(AccessList().text() + "# a comment\n\n# another", "file").or_throw().grants().empty());
}

TEST(AccessList, AFileWithoutItsFirstLineIsRefused) {
  for (const char* text : {"", "\n", "# a comment\n"})
    EXPECT_EQ(AccessList::parse(text, "file").reason(), Reason::BAD_CONFIG) << text;
}

TEST(AccessList, AMalformedLineIsNamed) {
  const std::string line = "token " + kHash + " robot 2027-11-29T00:00:00Z valid cart\n";
  const std::string good = AccessList().text() + line;
  ASSERT_TRUE(AccessList::parse(good, "file").ok());
  for (const std::string& bad : std::vector<std::string>{
           "password x", "token", "token " + kHash.substr(1) + " robot 2027-11-29T00:00:00Z valid cart",
           "token " + std::string(64, 'A') + " robot 2027-11-29T00:00:00Z valid cart",
           "token " + kOther + " king 2027-11-29T00:00:00Z valid cart",
           "token " + kOther + " robot tomorrow valid cart",
           "token " + kOther + " robot 2027-02-30T00:00:00Z valid cart",
           "token " + kOther + " robot 2027-2-3T00:00:00Z valid cart",
           "token " + kOther + " robot 2027-11-29T00:00:00Z maybe cart",
           "token " + kOther + " robot 2027-11-29T00:00:00Z valid",
           "token " + kOther + " robot 2027-11-29T00:00:00Z valid ",
           "token " + kOther + "  robot 2027-11-29T00:00:00Z valid cart", line}) {
    const auto parsed = AccessList::parse(good + bad + "\n", "file");
    EXPECT_EQ(parsed.reason(), Reason::BAD_CONFIG) << bad;
    EXPECT_THAT(parsed.status().message(), HasSubstr("file:3: ")) << bad;
  }
}

TEST(AccessList, NamesThatMeanNoCredentialsAreRefused) {
  for (const char* name : {"relmapd", "local", "anonymous"}) {
    const auto parsed = AccessList::parse(
        AccessList().text() + "token " + kHash + " operator 2027-11-29T00:00:00Z valid " + name + "\n", "file");
    EXPECT_EQ(parsed.reason(), Reason::BAD_CONFIG) << name;
    EXPECT_THAT(parsed.status().message(), HasSubstr("file:2: '" + std::string(name) + "' is no name for credentials"))
        << name;
  }
}

TEST(AccessList, RevokingTakesAllOfAName) {
  AccessList list;
  list.add({Grant::Kind::kToken, kHash, {Role::kRobot, "cart"}, 0, false});
  list.add({Grant::Kind::kCertificate, kOther, {Role::kRobot, "cart"}, 0, false});
  list.add({Grant::Kind::kToken, std::string(64, 'c'), {Role::kRobot, "other"}, 0, false});
  EXPECT_EQ(list.revoke("nobody"), 0u);
  EXPECT_EQ(list.revoke("cart"), 2u);
  EXPECT_EQ(list.revoke("cart"), 0u);
  EXPECT_TRUE(list.grants()[0].revoked && list.grants()[1].revoked && !list.grants()[2].revoked);
}

TEST(AccessList, TimesAreThoseOfRfc3339) {
  for (const std::int64_t seconds : {0ll, 951'782'400ll, 4'102'444'799ll})
    EXPECT_EQ(time_of(time_text(seconds)), seconds);
  EXPECT_EQ(time_text(951'782'400), "2000-02-29T00:00:00Z");
  for (const char* bad : {"", "2027-11-29", "2027-11-29T00:00:00", "2027-11-29T00:00:00+01:00", "2027-11-29T24:00:00Z"})
    EXPECT_FALSE(time_of(bad)) << bad;
}

TEST(Token, IsRandomAndKnownByItsHash) {
  const std::string token = new_token();
  EXPECT_EQ(token.size(), 64u);
  EXPECT_NE(token, new_token());
  // FIPS 180-4, the example "abc".
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace relmap::access
