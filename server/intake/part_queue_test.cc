#include "server/intake/part_queue.h"

#include <gtest/gtest.h>

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

constexpr std::size_t kPart = sizeof(KeyframePart) + 1400;

TEST(PartQueue, IsFirstInFirstOutForOneSender) {
  PartQueue queue(100 * kPart);
  for (std::uint32_t s = 0; s < 50; ++s) queue.push(sender(1), part(1, s));
  EXPECT_EQ(queue.of(sender(1)).waiting, 50u);
  for (std::uint32_t s = 0; s < 50; ++s) EXPECT_EQ(queue.pop()->sequence, s);
  EXPECT_FALSE(queue.pop());
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.bytes(), 0u);
}

// A sender with few parts does not wait behind one with many; turns are counted in bytes, not in parts.
TEST(PartQueue, SendersAreServedInTurnByBytes) {
  PartQueue queue(std::size_t{64} << 20);
  for (std::uint32_t s = 0; s < 1000; ++s) queue.push(sender(1), part(1, s, 1400));
  for (std::uint32_t s = 0; s < 1000; ++s) queue.push(sender(2), part(2, s, 14000));
  std::size_t bytes[3] = {};
  for (int i = 0; i < 600; ++i) {
    const auto next = queue.pop();
    ASSERT_TRUE(next);
    bytes[next->session.bytes[0]] += next->data.size();
  }
  EXPECT_NEAR(static_cast<double>(bytes[1]) / static_cast<double>(bytes[2]), 1, 0.15);
}

TEST(PartQueue, TheLongestQueueGivesWay) {
  PartQueue queue(100 * kPart);
  for (std::uint32_t s = 0; s < 10; ++s) queue.push(sender(2), part(2, s));
  for (std::uint32_t s = 0; s < 1000; ++s) queue.push(sender(1), part(1, s));
  for (std::uint32_t s = 10; s < 20; ++s) queue.push(sender(2), part(2, s));
  EXPECT_LE(queue.bytes(), 100 * kPart);
  EXPECT_EQ(queue.of(sender(2)).waiting, 20u);
  EXPECT_EQ(queue.of(sender(2)).dropped, 0u);
  EXPECT_EQ(queue.of(sender(1)).waiting, 80u);
  EXPECT_EQ(queue.of(sender(1)).dropped, 920u);
  for (std::uint32_t s = 0, mine = 0, others = 0; s < 100; ++s) {
    const auto next = queue.pop();
    if (next->session == sender(1))
      EXPECT_EQ(next->sequence, others++);  // what it sent last was dropped
    else
      EXPECT_EQ(next->sequence, mine++);
  }
}

TEST(PartQueue, APartLargerThanTheQueueIsDropped) {
  PartQueue queue(kPart);
  queue.push(sender(1), part(1, 0, 2000));
  EXPECT_FALSE(queue.pop());
  queue.push(sender(2), part(2, 0));
  queue.push(sender(1), part(1, 1));  // as long a queue as the other's: who came first stays
  EXPECT_EQ(queue.pop()->session, sender(2));
  EXPECT_EQ(queue.of(sender(1)).dropped, 1u + 1u);
}

TEST(PartQueue, ForgetsUnknownSenders) {
  PartQueue queue(100 * kPart);
  for (const std::uint8_t n : {1, 2, 3}) queue.push(sender(n), part(n, 0));
  for (int i = 0; i < 200; ++i) queue.push(sender(3), part(3, 1));
  for (int i = 0; i < 2; ++i) (void)queue.pop();
  queue.keep_only({sender(2)});
  EXPECT_EQ(queue.of(sender(1)).waiting, 0u);
  EXPECT_GT(queue.of(sender(3)).waiting, 0u) << "what waits is not forgotten";
}

}  // namespace
}  // namespace relmap::intake
