#include "frontend/publishing/lcm/sealed_daemon.h"

#include <gtest/gtest.h>

#include "proto/wire/channels.h"

namespace relmap::publishing {
namespace {

using access::SealedBy;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kRun = 77;
const access::RobotKey kKey{{1}, {2}};

BootId boot(std::uint8_t n) {
  BootId id{};
  id[0] = n;
  return id;
}
MapIdentity map(std::uint8_t n) {
  MapIdentity identity;
  identity.uuid.bytes[0] = n;
  return identity;
}

class SealedDaemonTest : public ::testing::Test {
 protected:
  Bytes from_daemon(std::uint64_t count, const char* channel = kAckChannel, std::uint64_t run = kRun,
                    const access::RobotKey& key = kKey, SealedBy by = SealedBy::kDaemon) {
    Bytes message{1, 2, 3};
    access::Sealer(key.key).seal(by, channel, {}, {key.id, run, 1000 * count, count}, message);
    return message;
  }
  // Whether a message of the daemon of this boot counts.
  bool hear(std::uint8_t from, std::uint64_t count) {
    const Bytes datagram = from_daemon(count);
    const auto opened = daemon_.open(kAckChannel, datagram);
    return opened && daemon_.heard(boot(from), opened->seal, now_);
  }
  bool welcome(std::uint8_t from, std::uint8_t serves, std::uint64_t count) {
    EXPECT_TRUE(hear(from, count));
    return daemon_.welcome({boot(from), map(serves)}, now_);
  }
  access::Seal seal_of(Bytes& message, const char* channel = kGapChannel) {
    daemon_.seal(channel, message);
    return access::split_sealed(message).value().seal;
  }

  SealedDaemon daemon_{kKey, kRun};
  SealedDaemon::Time now_{seconds(100)};
};

TEST_F(SealedDaemonTest, OpensOnlyWhatADaemonSealedForThisRun) {
  EXPECT_TRUE(daemon_.open(kAckChannel, from_daemon(1)));
  EXPECT_FALSE(daemon_.open(kPoseChannel, from_daemon(1)));
  EXPECT_FALSE(daemon_.open(kAckChannel, from_daemon(1, kAckChannel, kRun + 1))) << "of an earlier process";
  EXPECT_FALSE(daemon_.open(kAckChannel, from_daemon(1, kAckChannel, kRun, {{1}, {3}})));
  EXPECT_FALSE(daemon_.open(kAckChannel, from_daemon(1, kAckChannel, kRun, {{2}, {2}})));
  EXPECT_FALSE(daemon_.open(kAckChannel, from_daemon(1, kAckChannel, kRun, kKey, SealedBy::kRobot))) << "its own echo";
  EXPECT_FALSE(daemon_.open(kAckChannel, Bytes(100)));
  EXPECT_FALSE(daemon_.open(kAckChannel, {}));
}

TEST_F(SealedDaemonTest, OfEachDaemonOnlyWhatIsNewerCounts) {
  EXPECT_TRUE(hear(1, 5));
  EXPECT_FALSE(hear(1, 5));
  EXPECT_FALSE(hear(1, 4));
  EXPECT_TRUE(hear(2, 4));
  EXPECT_TRUE(hear(1, 6));
}

TEST_F(SealedDaemonTest, SaysHelloUntilItIsWelcomedAndAgainInSilence) {
  EXPECT_TRUE(daemon_.wants_hello(now_));
  EXPECT_FALSE(daemon_.ready(now_));
  Bytes hello{9};
  daemon_.seal_hello(hello);
  const auto split = access::split_sealed(hello).value();
  EXPECT_TRUE(access::Sealer(kKey.key).verify(SealedBy::kRobot, kHelloChannel, {}, split));
  EXPECT_TRUE(hear(1, 1));
  EXPECT_FALSE(daemon_.ready(now_)) << "an acknowledgement is no welcome";
  EXPECT_TRUE(welcome(1, 1, 2));
  EXPECT_TRUE(daemon_.ready(now_));
  EXPECT_FALSE(daemon_.wants_hello(now_));
  now_ += seconds(1);
  EXPECT_TRUE(daemon_.wants_hello(now_));
  EXPECT_TRUE(daemon_.ready(now_));
  now_ += seconds(3);
  EXPECT_FALSE(daemon_.ready(now_)) << "the daemon would take no message with so old a time";
  EXPECT_TRUE(hear(1, 3));
  EXPECT_TRUE(daemon_.ready(now_));
}

TEST_F(SealedDaemonTest, SealsForTheDaemonWithItsNewestTimeAndEachCountOnce) {
  ASSERT_TRUE(welcome(1, 1, 5));
  Bytes first{1}, second{1};
  const access::Seal a = seal_of(first), b = seal_of(second);
  EXPECT_EQ(a.time_us, 5000u);
  EXPECT_EQ(a.run, kRun);
  EXPECT_EQ(b.count, a.count + 1);
  EXPECT_TRUE(access::Sealer(kKey.key).verify(SealedBy::kRobot, kGapChannel, boot(1), *access::split_sealed(first)));
  ASSERT_TRUE(hear(1, 8));
  Bytes third{1};
  EXPECT_EQ(seal_of(third).time_us, 8000u);
}

TEST_F(SealedDaemonTest, KeepsToItsDaemonWhileThatAnswers) {
  ASSERT_TRUE(welcome(1, 1, 1));
  EXPECT_FALSE(welcome(2, 1, 1)) << "a copy of the map";
  now_ += seconds(1);
  EXPECT_TRUE(welcome(2, 1, 2)) << "the daemon was started again";
  Bytes message{1};
  daemon_.seal(kGapChannel, message);
  EXPECT_TRUE(access::Sealer(kKey.key).verify(SealedBy::kRobot, kGapChannel, boot(2), *access::split_sealed(message)));
}

TEST_F(SealedDaemonTest, AddressesOneMapOnly) {
  ASSERT_TRUE(welcome(1, 1, 1));
  now_ += seconds(10);
  EXPECT_FALSE(welcome(2, 2, 1)) << "the first map is the session's for good";
  SealedDaemon pinned(kKey, kRun);
  pinned.pin(map(2).uuid);
  const access::Seal seal{kKey.id, kRun, 1, 1};
  ASSERT_TRUE(pinned.heard(boot(1), seal, now_) && pinned.heard(boot(2), seal, now_));
  EXPECT_FALSE(pinned.welcome({boot(1), map(1)}, now_));
  EXPECT_FALSE(pinned.ready(now_));
  EXPECT_TRUE(pinned.welcome({boot(2), map(2)}, now_));
  EXPECT_TRUE(pinned.ready(now_));
}

TEST_F(SealedDaemonTest, RemembersABoundedNumberOfDaemonsAndItsOwnAlways) {
  ASSERT_TRUE(welcome(1, 1, 1));
  for (std::uint8_t n = 2; n < 250; ++n) {
    now_ += milliseconds(1);
    EXPECT_TRUE(hear(n, 1));
  }
  EXPECT_FALSE(hear(1, 1));
  EXPECT_TRUE(daemon_.ready(now_));
}

}  // namespace
}  // namespace relmap::publishing
