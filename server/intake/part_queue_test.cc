#include "server/intake/part_queue.h"

#include <gtest/gtest.h>

#include <utility>

namespace relmap::intake {
namespace {

SessionUuid sender(std::uint8_t n) {
  SessionUuid uuid;
  uuid.bytes.fill(n);
  return uuid;
}

KeyframePart part(std::uint8_t from, std::uint32_t sequence, std::size_t bytes = 1400) {
  KeyframePart part;
  part.session = sender(from);
  part.sequence = sequence;
  part.data.assign(bytes, 1);
  return part;
}

constexpr std::size_t kPart = sizeof(PartQueue::Sent) + 1400;

void push(PartQueue& queue, std::uint8_t from, KeyframePart sent) {
  queue.push({sender(from), {}}, {std::move(sent), {}});
}

TEST(PartQueue, IsFirstInFirstOutForOneSender) {
  PartQueue queue(100 * kPart);
  for (std::uint32_t s = 0; s < 50; ++s) push(queue, 1, part(1, s));
  EXPECT_EQ(queue.of({sender(1), {}}).waiting, 50u);
  for (std::uint32_t s = 0; s < 50; ++s) EXPECT_EQ(queue.pop()->part.sequence, s);
  EXPECT_FALSE(queue.pop());
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.bytes(), 0u);
}

// A sender with few parts does not wait behind one with many; turns are counted in bytes, not in parts.
TEST(PartQueue, SendersAreServedInTurnByBytes) {
  PartQueue queue(std::size_t{64} << 20);
  for (std::uint32_t s = 0; s < 1000; ++s) push(queue, 1, part(1, s, 1400));
  for (std::uint32_t s = 0; s < 1000; ++s) push(queue, 2, part(2, s, 14000));
  std::size_t bytes[3] = {};
  for (int i = 0; i < 600; ++i) {
    const auto next = queue.pop();
    ASSERT_TRUE(next);
    bytes[next->part.session.bytes[0]] += next->part.data.size();
  }
  EXPECT_NEAR(static_cast<double>(bytes[1]) / static_cast<double>(bytes[2]), 1, 0.15);
}

TEST(PartQueue, TheLongestQueueGivesWay) {
  PartQueue queue(100 * kPart);
  for (std::uint32_t s = 0; s < 10; ++s) push(queue, 2, part(2, s));
  for (std::uint32_t s = 0; s < 1000; ++s) push(queue, 1, part(1, s));
  for (std::uint32_t s = 10; s < 20; ++s) push(queue, 2, part(2, s));
  EXPECT_LE(queue.bytes(), 100 * kPart);
  EXPECT_EQ(queue.of({sender(2), {}}).waiting, 20u);
  EXPECT_EQ(queue.of({sender(2), {}}).dropped, 0u);
  EXPECT_EQ(queue.of({sender(1), {}}).waiting, 80u);
  EXPECT_EQ(queue.of({sender(1), {}}).dropped, 920u);
  for (std::uint32_t s = 0, mine = 0, others = 0; s < 100; ++s) {
    const auto next = queue.pop();
    if (next->part.session == sender(1))
      EXPECT_EQ(next->part.sequence, others++);  // what it sent last was dropped
    else
      EXPECT_EQ(next->part.sequence, mine++);
  }
}

TEST(PartQueue, APartLargerThanTheQueueIsDropped) {
  PartQueue queue(kPart);
  push(queue, 1, part(1, 0, 2000));
  EXPECT_FALSE(queue.pop());
  push(queue, 2, part(2, 0));
  push(queue, 1, part(1, 1));  // as long a queue as the other's: who came first stays
  EXPECT_EQ(queue.pop()->part.session, sender(2));
  EXPECT_EQ(queue.of({sender(1), {}}).dropped, 1u + 1u);
}

// Who floods with sessions that have not begun delays only what else is his.
TEST(PartQueue, WhatHasNotBegunWaitsByRobot) {
  PartQueue queue(100 * kPart);
  for (std::uint32_t s = 0; s < 1000; ++s) queue.push({{}, "flood"}, {part(1, s), {"flood"}});
  queue.push({{}, "cart"}, {part(2, 0), {"cart"}});
  queue.push({}, {part(3, 0), {{}, true}});
  std::size_t floods = 0;
  for (auto next = queue.pop(); next->sender.robot != "cart"; next = queue.pop())
    floods += next->sender.robot == "flood";
  EXPECT_LT(floods, 15u);
}

TEST(PartQueue, ForgetsUnknownSenders) {
  PartQueue queue(100 * kPart);
  for (const std::uint8_t n : {1, 2, 3}) push(queue, n, part(n, 0));
  for (int i = 0; i < 200; ++i) push(queue, 3, part(3, 1));
  for (int i = 0; i < 2; ++i) (void)queue.pop();
  queue.keep_only([&](const Party& party) { return party.session == sender(2); });
  EXPECT_EQ(queue.of({sender(1), {}}).waiting, 0u);
  EXPECT_GT(queue.of({sender(3), {}}).waiting, 0u) << "what waits is not forgotten";
}

// A robot gets no more by sending more sessions, and takes nothing of the share of another whose session it sends to.
TEST(Party, IsARobotWithAllThatItSendsOrASessionOfOneWhoMaySendIt) {
  const Owner carts{"cart", true}, trolleys{"trolley", false};
  const Party cart{{}, "cart"}, thief{{}, "thief"}, others{};
  const Sender anyone{{}, true}, operators{};
  EXPECT_EQ(party_of(sender(1), {"cart"}, &carts), cart);
  EXPECT_EQ(party_of(sender(3), {"cart"}, nullptr), cart) << "also of what has not begun";
  EXPECT_EQ(party_of(sender(1), {"thief"}, &carts), thief);
  EXPECT_EQ(party_of(sender(1), operators, &carts), (Party{sender(1), {}}));
  EXPECT_EQ(party_of(sender(2), anyone, &trolleys), (Party{sender(2), {}}));
  EXPECT_EQ(party_of(sender(1), anyone, &carts), others) << "the cart proves who it is";
  EXPECT_EQ(party_of(sender(3), anyone, nullptr), others) << "it has not begun";
}

}  // namespace
}  // namespace relmap::intake
