#include "proto/access/credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>

#include "proto/access/certificate.h"
#include "proto/access/file.h"
#include "proto/access/token.h"

namespace relmap::access {
namespace {

using testing::HasSubstr;

const KeyPair& authority() {
  static const KeyPair kAuthority = new_authority("fleet", 10);
  return kAuthority;
}
KeyPair issued(const Principal& principal) { return issue(authority(), {principal.name, {}, principal, 2}).or_throw(); }

TEST(Certificate, SaysWhoItsOwnerIs) {
  const Principal cart{Role::kRobot, "cart, 1:ß"};
  const KeyPair pair = issued(cart);
  EXPECT_TRUE(check_key_pair(pair).ok());
  const auto facts = read_certificate(pair.certificate);
  ASSERT_TRUE(facts.ok()) << facts.status().to_string();
  EXPECT_EQ(facts->principal, cart);
  EXPECT_EQ(facts->hash.size(), 64u);
  const std::int64_t now =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_NEAR(static_cast<double>(facts->expires_s - now), 2 * 86'400, 3600);
  EXPECT_NE(read_certificate(issued(cart).certificate)->hash, facts->hash) << "each has its own key and number";
}

TEST(Certificate, OnesOfDaemonsAndAuthoritiesNameNobody) {
  const auto daemon = issue(authority(), {"relmapd", {"map.lab", "10.0.0.5", "::1"}, {}, 1}).or_throw();
  EXPECT_FALSE(read_certificate(daemon.certificate)->principal);
  EXPECT_EQ(read_certificate(daemon.key + daemon.certificate)->hosts,
            (std::vector<std::string>{"map.lab", "10.0.0.5", "::1"}));
  EXPECT_FALSE(read_certificate(authority().certificate)->principal);
}

TEST(Certificate, WhatIsNoneIsRefused) {
  EXPECT_EQ(read_certificate("").reason(), Reason::CORRUPT);
  EXPECT_EQ(read_certificate(authority().key).reason(), Reason::CORRUPT);
  const KeyPair one = issued({Role::kReader, "a"}), other = issued({Role::kReader, "b"});
  EXPECT_EQ(check_key_pair({one.certificate, other.key}).reason(), Reason::CORRUPT);
  EXPECT_EQ(check_key_pair({one.certificate, "no key"}).reason(), Reason::CORRUPT);
  EXPECT_EQ(issue({one.certificate, other.key}, {"x", {}, Principal{Role::kReader, "x"}, 1}).reason(), Reason::CORRUPT);
}

TEST(Credentials, AreReadAsTheyWereWritten) {
  const KeyPair pair = issued({Role::kRobot, "cart"});
  const Credentials by_certificate{authority().certificate, pair.certificate, pair.key, ""};
  const Credentials by_token{authority().certificate, "", "", new_token()};
  Credentials with_key = by_certificate;
  with_key.robot_key = robot_key(random_key(), random_key());
  for (const Credentials& given : {by_certificate, by_token, with_key}) {
    const auto again = parse_credentials("A line before.\n" + text_of(given));
    ASSERT_TRUE(again.ok()) << again.status().to_string();
    EXPECT_EQ(again->authorities, given.authorities);
    EXPECT_EQ(again->certificate, given.certificate);
    EXPECT_EQ(again->key, given.key);
    EXPECT_EQ(again->token, given.token);
    EXPECT_EQ(again->robot_key, given.robot_key);
  }
}

TEST(Credentials, WhatIsIncompleteIsRefused) {
  const KeyPair pair = issued({Role::kRobot, "cart"}), other = issued({Role::kRobot, "other"});
  const std::string& trust = authority().certificate;
  const Credentials token{trust, "", "", new_token()};
  for (const std::string& text :
       {std::string(), trust, pair.key, pair.key + pair.certificate, pair.key + trust,
        pair.key + other.certificate + trust, text_of(token) + pair.key + pair.certificate,
        text_of({"", "", "", "token"}), text_of(token) + "-----BEGIN RELMAP KEY-----\nAAAA\n-----END RELMAP KEY-----\n",
        std::string("-----BEGIN PRIVATE KEY-----\n")})
    EXPECT_EQ(parse_credentials(text).reason(), Reason::CORRUPT) << text;
}

TEST(Credentials, FilesAreTheirOwnersOnly) {
  std::string folder = (std::filesystem::temp_directory_path() / "relmap-test-XXXXXX").string();
  ASSERT_TRUE(mkdtemp(folder.data()));
  const std::string path = folder + "/cart.pem";
  const mode_t before = umask(0);
  EXPECT_TRUE(write_private_file(path, text_of({authority().certificate, "", "", new_token()})).ok());
  umask(before);
  struct stat facts {};
  ASSERT_EQ(stat(path.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0600u);
  EXPECT_TRUE(read_credentials(path).ok());
  ASSERT_EQ(chmod(path.c_str(), 0640), 0);
  const auto shared = read_credentials(path);
  EXPECT_EQ(shared.reason(), Reason::BAD_CONFIG);
  EXPECT_THAT(shared.status().message(), HasSubstr("chmod 600"));
  EXPECT_EQ(read_credentials(folder + "/nowhere").reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(write_private_file(folder + "/nowhere/cart.pem", "x").reason(), Reason::IO_ERROR);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace relmap::access
