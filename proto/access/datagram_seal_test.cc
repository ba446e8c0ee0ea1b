#include "proto/access/datagram_seal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "proto/base/hex.h"

namespace relmap::access {
namespace {

const SealKey kKey = key_of_hex(std::string(64, '7')).value();
const SealBoot kBoot{1, 2, 3};
const Bytes kMessage{10, 20, 30, 40};
const Seal kSeal{{9, 8, 7}, 5, 6, 7};

Bytes sealed(SealedBy by = SealedBy::kRobot, std::string_view channel = "GAP", const SealBoot& boot = kBoot,
             const SealKey& key = kKey) {
  Bytes bytes = kMessage;
  Sealer(key).seal(by, channel, boot, kSeal, bytes);
  return bytes;
}

bool verified(const Bytes& datagram, SealedBy by = SealedBy::kRobot, std::string_view channel = "GAP",
              const SealBoot& boot = kBoot, const SealKey& key = kKey) {
  const auto split = split_sealed(datagram);
  return split && Sealer(key).verify(by, channel, boot, *split);
}

TEST(DatagramSeal, IsVerifiedAsItWasMade) {
  const Bytes datagram = sealed();
  ASSERT_EQ(datagram.size(), kMessage.size() + kSealBytes);
  const auto split = split_sealed(datagram);
  ASSERT_TRUE(split);
  EXPECT_EQ(Bytes(split->message.begin(), split->message.end()), kMessage);
  EXPECT_EQ(split->seal.key, kSeal.key);
  EXPECT_EQ(split->seal.run, 5u);
  EXPECT_EQ(split->seal.time_us, 6u);
  EXPECT_EQ(split->seal.count, 7u);
  EXPECT_TRUE(verified(datagram));
  // One sealer serves many messages.
  Sealer sealer(kKey);
  for (int i = 0; i < 3; ++i) {
    Bytes again = kMessage;
    sealer.seal(SealedBy::kRobot, "GAP", kBoot, kSeal, again);
    EXPECT_EQ(again, datagram);
    EXPECT_TRUE(sealer.verify(SealedBy::kRobot, "GAP", kBoot, *split));
  }
}

TEST(DatagramSeal, CoversEveryBitOfTheMessageAndItself) {
  const Bytes datagram = sealed();
  for (std::size_t bit = 0; bit < 8 * datagram.size(); ++bit) {
    Bytes changed = datagram;
    changed[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_FALSE(verified(changed)) << bit;
  }
  Bytes longer = datagram, shorter = datagram;
  longer.insert(longer.begin(), 0);
  shorter.erase(shorter.begin());
  EXPECT_FALSE(verified(longer));
  EXPECT_FALSE(verified(shorter));
}

TEST(DatagramSeal, IsForOneDirectionChannelDaemonAndKey) {
  const Bytes datagram = sealed();
  SealBoot other_boot = kBoot;
  other_boot[15] = 1;
  SealKey other_key = kKey;
  other_key[31] ^= 1;
  EXPECT_FALSE(verified(datagram, SealedBy::kDaemon));
  EXPECT_FALSE(verified(datagram, SealedBy::kRobot, "END"));
  EXPECT_FALSE(verified(datagram, SealedBy::kRobot, "GAP", other_boot));
  EXPECT_FALSE(verified(datagram, SealedBy::kRobot, "GAP", kBoot, other_key));
  // The channel's name cannot run over into the boot id.
  EXPECT_FALSE(
      verified(sealed(SealedBy::kRobot, std::string_view("GAP\1", 4), {2, 3}), SealedBy::kRobot, "GAP", kBoot));
}

TEST(DatagramSeal, IsThatOfRfc2104) {
  // HMAC-SHA256, made with another program, of the bytes that the header lists, cut to 16.
  Bytes bytes;
  Sealer(SealKey{}).seal(SealedBy::kDaemon, "A", {}, {}, bytes);
  EXPECT_EQ(hex(ByteSpan(bytes).last(16)), "3d3372f57de3b2543e80b614492fa464");
}

TEST(DatagramSeal, WhatIsTooShortHasNone) {
  EXPECT_FALSE(split_sealed(Bytes(kSealBytes - 1)));
  EXPECT_TRUE(split_sealed(Bytes(kSealBytes))->message.empty());
}

TEST(RobotKey, FollowsFromTheSecretAndWhatWasDrawn) {
  const SealKey drawn = random_key();
  const RobotKey key = robot_key(kKey, drawn);
  EXPECT_EQ(robot_key(kKey, drawn), key);
  EXPECT_TRUE(std::equal(key.id.begin(), key.id.end(), drawn.begin()));
  EXPECT_NE(key.key, drawn);
  EXPECT_NE(robot_key(random_key(), drawn).key, key.key);
  EXPECT_NE(robot_key(kKey, random_key()).key, key.key);
}

TEST(RobotKey, HexadecimalDigitsAreBytes) {
  const SealKey key = random_key();
  EXPECT_EQ(key_of_hex(hex(key)), key);
  for (const std::string& bad : {std::string(), std::string(63, 'a'), std::string(65, 'a'), std::string(64, 'g')})
    EXPECT_FALSE(key_of_hex(bad)) << bad;
}

TEST(RobotKey, TheSecretIsForItsOwnerOnly) {
  std::string folder = (std::filesystem::temp_directory_path() / "relmap_secret_XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const std::string file = folder + "/lcm.key";
  EXPECT_EQ(read_secret(file).reason(), Reason::NO_SUCH_FILE);
  std::ofstream(file) << hex(kKey) << "\n";
  ::chmod(file.c_str(), 0640);
  EXPECT_EQ(read_secret(file).reason(), Reason::BAD_CONFIG);
  ::chmod(file.c_str(), 0600);
  EXPECT_EQ(read_secret(file).or_throw(), kKey);
  std::ofstream(file) << "too short\n";
  EXPECT_EQ(read_secret(file).reason(), Reason::BAD_CONFIG);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace relmap::access
