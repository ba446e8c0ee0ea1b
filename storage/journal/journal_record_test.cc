#include "storage/journal/journal_record.h"

#include <gtest/gtest.h>

#include "proto/base/crc32c.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

TEST(JournalRecord, GivesBackEveryBitOfRandomRecords) {
  RandomFrames random(1);
  std::vector<int> kinds(std::variant_size_v<JournalRecord>);
  for (std::uint64_t i = 0; i < 500; ++i) {
    const JournalRecord record = random.record();
    ++kinds[record.index()];
    const Bytes bytes = encode_record(record, i);
    const auto decoded = decode_record(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.status().to_string();
    EXPECT_EQ(decoded->record.index(), record.index());
    EXPECT_EQ(decoded->acknowledged_through, i);
    EXPECT_EQ(encode_record(decoded->record, i), bytes);
  }
  for (const int count : kinds) EXPECT_GT(count, 0);
}

TEST(JournalRecord, KeepsTheFieldsApart) {
  const KeyframeRecord record{4, 0xdeadbeef, {1, 2, 3}};
  const auto keyframe = std::get<KeyframeRecord>(decode_record(encode_record(record, 0))->record);
  EXPECT_EQ(keyframe.session, 4u);
  EXPECT_EQ(keyframe.crc, 0xdeadbeef);
  EXPECT_EQ(keyframe.payload, (Bytes{1, 2, 3}));
  const BindingRecord binding{{1, 2}, {{3, 4}, 5}, {{{{6, 7}, 8}, -1, 1.5f, 2.5f, 0.5f, 3, true}, {{}, 9}}};
  const auto got = std::get<BindingRecord>(decode_record(encode_record(binding, 0))->record);
  EXPECT_EQ(got.frame, binding.frame);
  EXPECT_EQ(got.closure, binding.closure);
  ASSERT_EQ(got.bindings.size(), 2u);
  EXPECT_EQ(got.bindings[0].landmark, binding.bindings[0].landmark);
  EXPECT_EQ(got.bindings[0].track, -1);
  EXPECT_EQ(got.bindings[0].u_right, 0.5f);
  EXPECT_EQ(got.bindings[0].level, 3);
  EXPECT_TRUE(got.bindings[0].aligned);
  EXPECT_FALSE(got.bindings[1].landmark.valid());
  EXPECT_EQ(got.bindings[1].track, 9);
  EXPECT_FALSE(got.bindings[1].aligned);
}

TEST(JournalRecord, KeepsTheExtensionsOfALaterVersion) {
  const Extensions unknown = {{7, {}}, {1000, {1, 2, 3}}};
  ClosureProposalRecord proposal;
  proposal.uniqueness.known = true;
  proposal.uniqueness.runner_up = {3, 4};
  proposal.uniqueness.alike = 2;
  proposal.uniqueness.compared = 30;
  proposal.uniqueness.changed = 4;
  proposal.around = std::make_shared<const WayAround>(WayAround{{5, 6}, {}, 2 * Matrix6::Identity()});
  proposal.unseen = {{7, 8}, 9};
  proposal.unknown = unknown;
  const auto got = std::get<ClosureProposalRecord>(decode_record(encode_record(proposal, 0))->record);
  EXPECT_EQ(got.uniqueness, proposal.uniqueness);
  ASSERT_TRUE(got.around);
  EXPECT_EQ(*got.around, *proposal.around);
  EXPECT_EQ(got.unseen, proposal.unseen);
  EXPECT_EQ(got.unknown, unknown);
  SetEdgeStateRecord edit{{{1, 2}, 3}, EdgeState::kAccepted, "a note", true, true, 7, unknown};
  const auto edited = std::get<SetEdgeStateRecord>(decode_record(encode_record(edit, 0))->record);
  EXPECT_TRUE(edited.decided);
  EXPECT_TRUE(edited.alone);
  EXPECT_EQ(edited.shown, 7u);
  EXPECT_EQ(edited.unknown, unknown);
  const SetLabelRecord label{{1, 2}, "dock", true, unknown};
  EXPECT_EQ(std::get<SetLabelRecord>(decode_record(encode_record(label, 0))->record).unknown, unknown);
  const SetSessionStateRecord state{1, SessionState::kFrozen, unknown};
  EXPECT_EQ(std::get<SetSessionStateRecord>(decode_record(encode_record(state, 0))->record).unknown, unknown);
  SessionRecord session;
  session.header.unknown = unknown;
  EXPECT_EQ(std::get<SessionRecord>(decode_record(encode_record(session, 0))->record).header.unknown, unknown);
}

TEST(JournalRecord, AnEditKeepsItsName) {
  const EditKey named{"by robot-7, \0 and all", 0x0123'4567'89ab'cdef};
  const auto kept = [&](JournalRecord record) {
    *edit_key(record) = named;
    auto decoded = decode_record(encode_record(record, 0)).or_throw();
    return *edit_key(decoded.record) == named;
  };
  EXPECT_TRUE(kept(ClosureProposalRecord()));
  EXPECT_TRUE(kept(SetEdgeStateRecord()));
  EXPECT_TRUE(kept(SetLabelRecord()));
  EXPECT_TRUE(kept(SetSessionStateRecord()));
  JournalRecord other = GapRecord();
  EXPECT_EQ(edit_key(other), nullptr);

  SetLabelRecord long_name;
  long_name.edit = {std::string(kMaxEditKeyBytes + 1, 'k'), 1};
  EXPECT_EQ(decode_record(encode_record(long_name, 0)).reason(), Reason::CORRUPT);
}

TEST(JournalRecord, SaysWhenItWasSubmittedAndByWhom) {
  const Submission ann{1'700'000'000'000'000, "ann"};
  const auto kept = [&](JournalRecord record, const Submission& submitted) {
    *submission(record) = submitted;
    auto decoded = decode_record(encode_record(record, 0)).or_throw();
    return *submission(decoded.record) == submitted;
  };
  SetLabelRecord named;
  named.edit = {"a key", 7};
  named.unknown = {{7, {}}, {1000, {1}}};
  SessionRecord session;
  session.header.unknown = named.unknown;
  for (const Submission& submitted : {ann, Submission{ann.time_us, ""}, Submission{0, "ann"}, Submission{}}) {
    EXPECT_TRUE(kept(session, submitted));
    EXPECT_TRUE(kept(ClosureProposalRecord(), submitted));
    EXPECT_TRUE(kept(SetEdgeStateRecord(), submitted));
    EXPECT_TRUE(kept(named, submitted));
    EXPECT_TRUE(kept(SetSessionStateRecord(), submitted));
  }
  JournalRecord other = KeyframeRecord();
  EXPECT_EQ(submission(other), nullptr);
  EXPECT_EQ(encode_record(SetLabelRecord(), 0)[0], 1) << "as before records said it";

  session.header.unknown = {{19, {1}}, {20, Bytes(1000)}, {1000, {1}}};
  EXPECT_TRUE(kept(session, ann)) << "whatever a robot said";
  EXPECT_TRUE(kept(session, {}));

  SetLabelRecord long_name;
  long_name.submitted.author = std::string(kMaxAuthorBytes + 1, 'k');
  EXPECT_EQ(decode_record(encode_record(long_name, 0)).reason(), Reason::CORRUPT);
}

TEST(JournalRecord, WithoutExtensionsIsWhatFormat2Wrote) {
  SetEdgeStateRecord edit{{{1, 2}, 3}, EdgeState::kRemoved, "", false, false, 0, {}};
  EXPECT_EQ(encode_record(edit, 0)[0], 1);
  edit.alone = true;
  EXPECT_EQ(encode_record(edit, 0)[0], 2);
  edit.alone = false;
  edit.decided = true;
  EXPECT_EQ(encode_record(edit, 0)[0], 2);
  edit.decided = false;
  edit.shown = 7;
  EXPECT_EQ(encode_record(edit, 0)[0], 2);
}

TEST(JournalRecord, RefusesEveryTruncationAndEveryFlippedBit) {
  RandomFrames random(2);
  for (int i = 0; i < 20; ++i) {
    Bytes bytes = encode_record(random.record(), 7);
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_EQ(decode_record(ByteSpan(bytes).first(size)).reason(), Reason::TRUNCATED) << size;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      EXPECT_FALSE(decode_record(bytes).ok()) << bit;
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    }
  }
}

TEST(JournalRecord, NamesAVersionItDoesNotKnow) {
  Bytes bytes = encode_record(IdleWorkRecord{5}, 0);
  bytes[0] = 99;
  const std::uint32_t crc = crc32c(ByteSpan(bytes).first(bytes.size() - 4));
  std::memcpy(bytes.data() + bytes.size() - 4, &crc, 4);
  EXPECT_EQ(decode_record(bytes).reason(), Reason::UNKNOWN_FORMAT_VERSION);
}

}  // namespace
}  // namespace relmap::storage
