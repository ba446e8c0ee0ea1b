#include "server/ingest/sealed_robots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/base/hex.h"
#include "proto/wire/channels.h"

namespace relmap::ingest {
namespace {

using access::Grant;
using access::Role;
using access::SealedBy;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::int64_t kNow = 1'800'000'000, kExpires = kNow + 1000;
const access::SealKey kSecret{1};

// What one process of a robot seals, by hand.
struct HandRun {
  access::RobotKey key;
  std::uint64_t run = 1;
  std::uint64_t count = 0;

  Bytes seal(const BootId& boot, std::uint64_t time_us, const char* channel = kGapChannel, Bytes message = {1, 2, 3}) {
    access::Sealer(key.key).seal(SealedBy::kRobot, channel, boot, {key.id, run, time_us, ++count}, message);
    return message;
  }
};

class SealedRobotsTest : public ::testing::Test {
 protected:
  SealedRobotsTest() { use(); }

  // Issues a key; use() makes the daemon know it.
  access::RobotKey issue(const std::string& name, Role role = Role::kRobot) {
    access::SealKey drawn{};
    drawn[0] = static_cast<std::uint8_t>(list_.grants().size() + 1);
    list_.add({Grant::Kind::kKey, hex(drawn), {role, name}, kExpires, false});
    return access::robot_key(kSecret, drawn);
  }
  void use() { robots_.use(list_); }
  Reason open(const Bytes& datagram, const char* channel = kGapChannel, std::int64_t utc_s = kNow) {
    return robots_.open(channel, datagram, now_, utc_s).reason();
  }
  std::uint64_t time_us() const {
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(now_ - start_).count());
  }

  const BootId boot_{7, 7};
  const SealedRobots::Time start_{seconds(1000)};
  SealedRobots::Time now_ = start_ + seconds(60);
  access::AccessList list_;
  SealedRobots robots_{boot_, kSecret, start_};
};

TEST_F(SealedRobotsTest, OpensWhatARobotSealedAndSaysWhoItIs) {
  HandRun cart{issue("cart")};
  use();
  const Bytes datagram = cart.seal(boot_, time_us());
  const auto opened = robots_.open(kGapChannel, datagram, now_, kNow);
  ASSERT_TRUE(opened.ok()) << opened.status().to_string();
  EXPECT_EQ(opened->robot, "cart");
  EXPECT_EQ(opened->run, 1u);
  EXPECT_EQ(Bytes(opened->message.begin(), opened->message.end()), (Bytes{1, 2, 3}));
}

TEST_F(SealedRobotsTest, RefusesWhoeverIsNotKnown) {
  HandRun cart{issue("cart")}, stranger{access::robot_key(access::SealKey{9}, access::SealKey{1})};
  HandRun operator_{issue("anna", Role::kOperator)};
  EXPECT_EQ(open(cart.seal(boot_, time_us())), Reason::UNAUTHENTICATED) << "its key is not in use yet";
  use();
  EXPECT_EQ(open(cart.seal(boot_, time_us())), Reason::OK);
  EXPECT_EQ(open(stranger.seal(boot_, time_us())), Reason::UNAUTHENTICATED);
  stranger.key.id = cart.key.id;  // the right name for a wrong key
  EXPECT_EQ(open(stranger.seal(boot_, time_us())), Reason::UNAUTHENTICATED);
  EXPECT_EQ(open(operator_.seal(boot_, time_us())), Reason::UNAUTHENTICATED) << "keys are robots'";
  EXPECT_EQ(open(Bytes{1, 2, 3}), Reason::UNAUTHENTICATED);
  EXPECT_EQ(open(Bytes(500, 0)), Reason::UNAUTHENTICATED);
  EXPECT_EQ(open({}), Reason::UNAUTHENTICATED);
}

TEST_F(SealedRobotsTest, RefusesWhatWasSealedForElsewhere) {
  HandRun cart{issue("cart")};
  use();
  BootId other = boot_;
  other[0] ^= 1;
  EXPECT_EQ(open(cart.seal(other, time_us())), Reason::UNAUTHENTICATED) << "for another daemon, or before its restart";
  EXPECT_EQ(open(cart.seal({}, time_us())), Reason::UNAUTHENTICATED) << "for any daemon, as only a hello is";
  EXPECT_EQ(open(cart.seal(boot_, time_us()), kEndChannel), Reason::UNAUTHENTICATED) << "on another channel";
  Bytes by_daemon{1, 2, 3};
  access::Sealer(cart.key.key).seal(SealedBy::kDaemon, kGapChannel, boot_, {cart.key.id, 1, time_us(), 1}, by_daemon);
  EXPECT_EQ(open(by_daemon), Reason::UNAUTHENTICATED);
}

TEST_F(SealedRobotsTest, AMessageCountsOnceAndForTenSeconds) {
  HandRun cart{issue("cart")};
  use();
  const Bytes first = cart.seal(boot_, time_us()), second = cart.seal(boot_, time_us());
  EXPECT_EQ(open(second), Reason::OK) << "they may overtake one another";
  EXPECT_EQ(open(first), Reason::OK);
  EXPECT_EQ(open(first), Reason::REPLAYED);
  const Bytes held_back = cart.seal(boot_, time_us());
  now_ += SealedRobots::kFresh + milliseconds(1);
  EXPECT_EQ(open(held_back), Reason::REPLAYED);
  EXPECT_EQ(open(cart.seal(boot_, time_us() + 1000)), Reason::REPLAYED) << "of a time that was never told";
  EXPECT_EQ(open(cart.seal(boot_, UINT64_MAX)), Reason::REPLAYED);
  EXPECT_EQ(open(cart.seal(boot_, time_us())), Reason::OK);
}

TEST_F(SealedRobotsTest, AKeyEndsWithItsTimeOrWhenItIsRevoked) {
  HandRun cart{issue("cart")}, other{issue("other")};
  use();
  EXPECT_EQ(open(cart.seal(boot_, time_us()), kGapChannel, kExpires - 1), Reason::OK);
  EXPECT_EQ(open(cart.seal(boot_, time_us()), kGapChannel, kExpires), Reason::UNAUTHENTICATED);
  const Bytes once = other.seal(boot_, time_us());
  EXPECT_EQ(open(once), Reason::OK);
  list_.revoke("cart");
  use();
  EXPECT_EQ(open(cart.seal(boot_, time_us())), Reason::UNAUTHENTICATED);
  EXPECT_EQ(open(once), Reason::REPLAYED) << "a list that is read again lets nothing pass twice";
  EXPECT_EQ(open(other.seal(boot_, time_us())), Reason::OK);
}

TEST_F(SealedRobotsTest, WhoIsKnownAndMayNoLongerSendIsNamedNowAndThen) {
  HandRun cart{issue("cart")}, other{issue("other")};
  use();
  const auto complaint_after = [&](const Bytes& message, std::int64_t utc_s) {
    EXPECT_EQ(open(message, kGapChannel, utc_s), Reason::UNAUTHENTICATED);
    return robots_.take_complaint();
  };
  EXPECT_THAT(complaint_after(cart.seal(boot_, time_us()), kExpires),
              testing::HasSubstr("the key of cart expired at "));
  EXPECT_EQ(complaint_after(cart.seal(boot_, time_us()), kExpires + 1), "");
  EXPECT_NE(complaint_after(other.seal(boot_, time_us()), kExpires + 1), "");
  EXPECT_NE(complaint_after(cart.seal(boot_, time_us()), kExpires + 600), "");
  list_.revoke("cart");
  use();
  Bytes forged = cart.seal(boot_, time_us());
  forged[0] ^= 1;
  EXPECT_EQ(complaint_after(forged, kNow), "") << "whoever knows the id of a key does not fill the log";
  EXPECT_EQ(complaint_after(cart.seal(boot_, time_us()), kNow), "the key of cart was revoked");
}

// What was sent by processes that are forgotten does not pass again.
TEST_F(SealedRobotsTest, OneRobotsProcessesAreLimited) {
  const access::RobotKey key = issue("cart");
  use();
  std::vector<Bytes> sent;
  for (std::uint64_t run = 1; run <= SealedRobots::kMaxRuns; ++run) {
    HandRun process{key, run};
    sent.push_back(process.seal(boot_, time_us()));
    EXPECT_EQ(open(sent.back()), Reason::OK);
  }
  HandRun one_more{key, 1000};
  EXPECT_EQ(open(one_more.seal(boot_, time_us())), Reason::RATE_LIMITED);
  now_ += 2 * SealedRobots::kFresh + milliseconds(1);
  EXPECT_EQ(open(one_more.seal(boot_, time_us())), Reason::OK);
  for (const Bytes& datagram : sent) EXPECT_EQ(open(datagram), Reason::REPLAYED);
}

TEST_F(SealedRobotsTest, AnswersAreForTheProcessThatSendsTheSession) {
  HandRun cart{issue("cart"), 11}, other{issue("other"), 22};
  use();
  const SessionUuid session = SessionUuid::random();
  const auto sends = [&](HandRun& from, const SessionUuid& what) {
    const Bytes datagram = from.seal(boot_, time_us());
    robots_.sends(robots_.open(kGapChannel, datagram, now_, kNow).or_throw(), what);
  };
  EXPECT_TRUE(robots_.seal(session, "cart", kAckChannel, {5}, now_).empty());
  sends(cart, session);
  sends(other, SessionUuid::random());
  auto sealed = robots_.seal(session, "cart", kAckChannel, {5}, now_);
  ASSERT_EQ(sealed.size(), 1u);
  auto split = access::split_sealed(sealed[0]).value();
  EXPECT_EQ(split.seal.run, 11u);
  EXPECT_EQ(split.seal.time_us, time_us());
  EXPECT_TRUE(access::Sealer(cart.key.key).verify(SealedBy::kDaemon, kAckChannel, {}, split));
  EXPECT_FALSE(access::Sealer(other.key.key).verify(SealedBy::kDaemon, kAckChannel, {}, split));
  const std::uint64_t count = split.seal.count;
  cart.run = 12;  // the front-end was started again
  sends(cart, session);
  sealed = robots_.seal(session, "cart", kAckChannel, {5}, now_);
  ASSERT_EQ(sealed.size(), 1u);
  split = access::split_sealed(sealed[0]).value();
  EXPECT_EQ(split.seal.run, 12u);
  EXPECT_GT(split.seal.count, count);
  sends(other, session);  // whatever it sends is not taken, and takes nothing from the first
  sealed = robots_.seal(session, "cart", kAckChannel, {5}, now_);
  ASSERT_EQ(sealed.size(), 1u) << "nobody else hears of it";
  EXPECT_EQ(access::split_sealed(sealed[0])->seal.run, 12u);
  EXPECT_TRUE(robots_.seal(session, "", kAckChannel, {5}, now_).empty()) << "nobody's yet";
  for (std::size_t i = 0; i < 2 * SealedRobots::kMaxSessions; ++i) sends(other, SessionUuid::random());
  EXPECT_EQ(robots_.seal(session, "cart", kAckChannel, {5}, now_).size(), 1u) << "one robot's sessions are limited";
  list_.revoke("cart");
  use();
  EXPECT_TRUE(robots_.seal(session, "cart", kAckChannel, {5}, now_).empty());
}

TEST_F(SealedRobotsTest, AHelloIsAnsweredWhateverItsDaemonAndTime) {
  HandRun cart{issue("cart"), 5}, stranger{access::robot_key(access::SealKey{9}, access::SealKey{1})};
  use();
  const Bytes hello = cart.seal({}, 0, kHelloChannel);
  const auto opened = robots_.open_hello(hello, kNow);
  ASSERT_TRUE(opened.ok()) << opened.status().to_string();
  const Bytes welcome = robots_.welcome(*opened, {1}, now_);
  const auto split = access::split_sealed(welcome);
  ASSERT_TRUE(split);
  EXPECT_EQ(split->seal.run, 5u);
  EXPECT_TRUE(access::Sealer(cart.key.key).verify(SealedBy::kDaemon, kMapChannel, {}, *split));
  EXPECT_TRUE(robots_.welcome(*opened, {1}, now_).empty()) << "a replayed hello makes no flood of answers";
  HandRun former = cart;
  former.run = 4;
  const Bytes old = former.seal({}, 0, kHelloChannel);  // which anyone may send again
  EXPECT_FALSE(robots_.welcome(robots_.open_hello(old, kNow).or_throw(), {1}, now_).empty());
  now_ += milliseconds(5);
  EXPECT_FALSE(robots_.welcome(robots_.open_hello(old, kNow).or_throw(), {1}, now_).empty());
  EXPECT_FALSE(robots_.welcome(*opened, {1}, now_).empty()) << "it leaves the present process its answers";
  EXPECT_EQ(robots_.open_hello(stranger.seal({}, 0, kHelloChannel), kNow).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(robots_.open_hello(cart.seal({}, 0, kGapChannel), kNow).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(robots_.open_hello(Bytes(3), kNow).reason(), Reason::UNAUTHENTICATED);
}

}  // namespace
}  // namespace relmap::ingest
