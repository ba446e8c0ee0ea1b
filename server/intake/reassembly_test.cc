#include "server/intake/reassembly.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "proto/base/crc32c.h"

namespace relmap::intake {
namespace {

SessionUuid session(std::uint8_t n) {
  SessionUuid uuid;
  uuid.bytes.fill(n);
  return uuid;
}

Bytes payload(std::size_t size, std::uint8_t seed = 1) {
  std::mt19937 random(seed);
  Bytes bytes(size);
  for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
  return bytes;
}

KeyframePart part(const SessionUuid& uuid, std::uint32_t sequence, const Bytes& bytes, std::uint32_t index,
                  std::uint32_t part_bytes = 1000) {
  return cut_part(uuid, sequence, bytes, crc32c(bytes), part_bytes, index);
}

class ReassemblyTest : public testing::Test {
 protected:
  Result<std::optional<Reassembly::Payload>> add(const KeyframePart& p) { return reassembly_.add(p, {p.session, {}}); }

  storage::Budget budget_{std::size_t{16} << 20};  // 1 MiB of it for reassembly
  Reassembly reassembly_{budget_};
};

TEST_F(ReassemblyTest, PartsInAnyOrderAndTwiceGiveThePayloadOnce) {
  const Bytes bytes = payload(10'300);
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < 11; ++i) order.insert(order.end(), {i, i});
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  // Up to the last part that is new; after it the doubles would begin another assembly.
  std::vector<bool> seen(11);
  std::size_t distinct = 0, whole = 0;
  for (const std::uint32_t i : order) {
    if (distinct == 11) break;
    auto result = add(part(session(1), 5, bytes, i));
    ASSERT_TRUE(result.ok());
    if (!seen[i]) ++distinct;
    seen[i] = true;
    if (!result->has_value()) continue;
    ++whole;
    EXPECT_EQ((*result)->bytes, bytes);
    EXPECT_EQ((*result)->crc, crc32c(bytes));
  }
  EXPECT_EQ(whole, 1u);
  EXPECT_EQ(reassembly_.size(), 0u);
  EXPECT_EQ(budget_.used(storage::Share::kReassembly), 0u);
}

TEST_F(ReassemblyTest, ListsMissingParts) {
  const Bytes bytes = payload(5000);
  for (const std::uint32_t i : {0u, 2u, 3u}) ASSERT_TRUE(add(part(session(1), 7, bytes, i)).ok());
  ASSERT_TRUE(add(part(session(2), 7, bytes, 0)).ok());
  const auto missing = reassembly_.missing(session(1));
  ASSERT_EQ(missing.size(), 1u);
  EXPECT_EQ(missing[0].sequence, 7u);
  EXPECT_EQ(missing[0].parts, (std::vector<std::uint32_t>{1, 4}));
  EXPECT_EQ(reassembly_.incomplete(session(1)), std::vector<std::uint32_t>{7});
}

TEST_F(ReassemblyTest, MissingPartsFitAnAcknowledgement) {
  for (std::uint32_t s = 0; s < 20; ++s)
    ASSERT_TRUE(add(part(session(1), s, payload(40'000, static_cast<std::uint8_t>(s + 1)), 0)).ok());
  const auto missing = reassembly_.missing(session(1));
  std::size_t parts = 0;
  for (const auto& m : missing) {
    EXPECT_FALSE(m.parts.empty());
    parts += m.parts.size();
  }
  EXPECT_LE(missing.size(), kMaxAckIncomplete);
  EXPECT_LE(parts, kMaxAckParts);
}

TEST_F(ReassemblyTest, AWrongPayloadChecksumIsCorruptAndReassemblyStartsAnew) {
  const Bytes bytes = payload(2000);
  const std::uint32_t wrong = crc32c(bytes) ^ 1;
  ASSERT_TRUE(add(cut_part(session(1), 0, bytes, wrong, 1000, 0)).ok());
  EXPECT_EQ(add(cut_part(session(1), 0, bytes, wrong, 1000, 1)).reason(), Reason::CORRUPT);
  EXPECT_EQ(reassembly_.size(), 0u);
  ASSERT_TRUE(add(part(session(1), 0, bytes, 0)).ok());
  EXPECT_TRUE(add(part(session(1), 0, bytes, 1))->has_value());
}

TEST_F(ReassemblyTest, VersionsOfAKeyframeAreNotMixed) {
  const Bytes one = payload(2000, 1), other = payload(2000, 2);
  ASSERT_TRUE(add(part(session(1), 0, one, 0)).ok());
  EXPECT_FALSE(add(part(session(1), 0, other, 1))->has_value());
  const auto whole = add(part(session(1), 0, one, 1));
  ASSERT_TRUE(whole.ok() && whole->has_value());
  EXPECT_EQ((**whole).bytes, one);
}

TEST_F(ReassemblyTest, AnotherPartSizeStartsReassemblyAnew) {
  const Bytes bytes = payload(2000);
  ASSERT_TRUE(add(part(session(1), 0, bytes, 0, 1000)).ok());
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_FALSE(add(part(session(1), 0, bytes, i, 600))->has_value());
  EXPECT_TRUE(add(part(session(1), 0, bytes, 3, 600))->has_value());
}

TEST_F(ReassemblyTest, UnderPressureDropsTheAssemblyThatWaitedLongest) {
  const Bytes bytes = payload(250'000);  // four and no more fit into 1 MiB
  for (std::uint32_t s = 0; s < 4; ++s) ASSERT_TRUE(add(part(session(1), s, bytes, 0)).ok());
  ASSERT_TRUE(add(part(session(1), 0, bytes, 1)).ok());  // 0 is fresh again; 1 waits longest
  ASSERT_TRUE(add(part(session(1), 4, bytes, 0)).ok());
  EXPECT_EQ(reassembly_.incomplete(session(1)), (std::vector<std::uint32_t>{0, 2, 3, 4}));
  EXPECT_EQ(reassembly_.evicted(), 1u);
  EXPECT_LE(budget_.used(storage::Share::kReassembly), budget_.allowance(storage::Share::kReassembly));
}

TEST_F(ReassemblyTest, TheLargestHolderGivesWay) {
  const Bytes bytes = payload(120'000);
  ASSERT_TRUE(add(part(session(1), 0, bytes, 0)).ok());  // has waited longest of all
  for (std::uint32_t s = 0; s < 9; ++s) ASSERT_TRUE(add(part(session(2), s, bytes, 0)).ok());
  EXPECT_EQ(reassembly_.incomplete(session(1)), std::vector<std::uint32_t>{0});
  EXPECT_EQ(reassembly_.incomplete(session(2)).front(), 2u);
  EXPECT_EQ(reassembly_.evicted(), 2u);
}

TEST_F(ReassemblyTest, RefusesWithoutAnyRoom) {
  const std::size_t all = budget_.allowance(storage::Share::kReassembly);
  ASSERT_TRUE(budget_.try_charge(storage::Share::kReassembly, all));
  EXPECT_EQ(add(part(session(1), 0, payload(2000), 0)).reason(), Reason::BUDGET_EXCEEDED);
  budget_.release(storage::Share::kReassembly, all);
}

TEST_F(ReassemblyTest, ForgetsSettledSequences) {
  const Bytes bytes = payload(2000);
  for (std::uint32_t s = 0; s < 5; ++s) ASSERT_TRUE(add(part(session(1), s, bytes, 0)).ok());
  ASSERT_TRUE(add(part(session(2), 0, bytes, 0)).ok());
  reassembly_.forget(session(1), 3);
  EXPECT_EQ(reassembly_.incomplete(session(1)), (std::vector<std::uint32_t>{3, 4}));
  EXPECT_TRUE(reassembly_.has_incomplete(session(2)));
}

TEST(CheckPart, NamesWhatIsWrong) {
  const Bytes bytes = payload(2500);
  const KeyframePart good = cut_part(session(1), 3, bytes, crc32c(bytes), 1000, 1);
  EXPECT_TRUE(check_part(good).ok());
  EXPECT_TRUE(check_part(cut_part(session(1), 3, bytes, crc32c(bytes), 1000, 2)).ok());
  EXPECT_TRUE(check_part(cut_part(session(1), 3, bytes, crc32c(bytes), 60000, 0)).ok());
  const auto reason = [&](auto&& change) {
    KeyframePart p = good;
    change(p);
    p.part_crc = part_checksum(p);
    return check_part(p).reason();
  };
  EXPECT_EQ(reason([](auto& p) { p.total_bytes = kMaxKeyframeBytes + 1; }), Reason::BAD_SIZE);
  EXPECT_EQ(reason([](auto& p) { p.total_bytes = 0; }), Reason::BAD_SIZE);
  EXPECT_EQ(reason([](auto& p) { p.parts = 0; }), Reason::BAD_SIZE);
  EXPECT_EQ(reason([](auto& p) { p.parts = 4; }), Reason::BAD_SIZE);
  EXPECT_EQ(reason([](auto& p) { p.part = 3; }), Reason::BAD_SIZE);
  EXPECT_EQ(reason([](auto& p) { p.offset = 999; }), Reason::BAD_SIZE);
  EXPECT_EQ(reason([](auto& p) { p.offset = 0xffffff00; }), Reason::TRUNCATED);
  EXPECT_EQ(reason([](auto& p) { p.data.clear(); }), Reason::TRUNCATED);
  EXPECT_EQ(reason([](auto& p) { p.data.resize(kMaxPartBytes + 1); }), Reason::BAD_SIZE);
  EXPECT_EQ(reason([](auto& p) { p.part = 2, p.offset = 2000, p.data.resize(400); }), Reason::TRUNCATED);
  // Damage, in the header as in the data.
  KeyframePart damaged = good;
  damaged.data[3] ^= 1;
  EXPECT_EQ(check_part(damaged).reason(), Reason::CORRUPT);
  damaged = good;
  ++damaged.sequence;
  EXPECT_EQ(check_part(damaged).reason(), Reason::CORRUPT);
}

}  // namespace
}  // namespace relmap::intake
