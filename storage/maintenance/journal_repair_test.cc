#include "storage/maintenance/journal_repair.h"

#include <gtest/gtest.h>

#include "storage/journal/journal_log.h"
#include "storage/journal/journal_record.h"
#include "storage/journal/journal_segment.h"
#include "storage/testing/forgetful_files.h"

namespace relmap::storage {
namespace {

std::string text_of(ByteSpan bytes) { return {bytes.begin(), bytes.end()}; }

// A record whose payload holds a whole one of the sequence after it, under every salt but the segment's.
TEST(JournalRepair, TakesNothingInsideAPayloadForARecord) {
  const auto disk = ForgetfulFiles::create(1);
  std::uint64_t next_salt = 0x1234567890abcdef;
  const auto append = [&](JournalLog& log, const std::string& label) {
    const Bytes record = encode_record(SetLabelRecord{{1, 2}, label, true, {}}, log.last());
    ASSERT_TRUE(log.append({&record, 1}).ok());
  };
  {
    const auto log =
        JournalLog::open(disk, "j", 0, {.segment_bytes = 1 << 20, .salts = [&] { return next_salt++; }}).or_throw();
    ByteWriter forged;
    for (const std::uint64_t guess : {std::uint64_t{0}, next_salt, std::uint64_t{1}})
      put_journal_record(forged, guess, 4, 3, encode_record(SetLabelRecord{{9, 9}, "forged", true, {}}, 3));
    append(*log, "one");
    append(*log, "two");
    append(*log, text_of(forged.bytes()));
    append(*log, "four");
    append(*log, "five");
  }
  const std::string path = "j/" + disk->list("j").value().front();
  ASSERT_EQ(SegmentName::parse(path.substr(2))->salt, 0x1234567890abcdefU);
  const auto reader = SegmentReader::open(*disk, path).or_throw();
  const auto third = reader.find_after(0, 2).or_throw();
  ASSERT_TRUE(third && third->sequence == 3);
  disk->damage(path, third->offset + 9);  // its length field

  const auto copy = repair_journal(disk, "j", "mended", 0, {}, {}, {}).or_throw();
  EXPECT_FALSE(copy.sound);
  ASSERT_EQ(copy.lost.size(), 1U);
  EXPECT_EQ(copy.lost[0].first, 3U);
  EXPECT_EQ(copy.lost[0].last, 3U);
  EXPECT_EQ(copy.last, 5U);
  std::vector<std::string> labels;
  const auto mended = JournalLog::open(disk, "mended", 0).or_throw();
  ASSERT_TRUE(mended
                  ->read(1,
                         [&](std::uint64_t, ByteSpan record) {
                           const auto decoded = decode_record(record).or_throw();
                           const auto* label = std::get_if<SetLabelRecord>(&decoded.record);
                           labels.push_back(label ? label->label : "-");
                           return true;
                         })
                  .ok());
  EXPECT_EQ(labels, (std::vector<std::string>{"one", "two", "-", "four", "five"}));
}

// A name is a few bytes of a folder, too: one that claims an absurd sequence makes no absurd number of substitutes.
TEST(JournalRepair, LeavesOutSegmentsThatCannotBelongToTheJournal) {
  const auto disk = ForgetfulFiles::create(1);
  {
    const auto log = JournalLog::open(disk, "j", 0, {}).or_throw();
    for (int i = 0; i < 3; ++i) {
      const Bytes record = encode_record(SetLabelRecord{{1, 2}, "label", true, {}}, log->last());
      ASSERT_TRUE(log->append({&record, 1}).ok());
    }
  }
  const std::uint64_t absurd = std::uint64_t{1} << 60;
  const auto file = disk->open_append("j/" + SegmentName{absurd, 5}.to_string()).or_throw();
  ASSERT_TRUE(file->append(segment_header(absurd, 5)).ok() && file->sync().ok());
  std::vector<std::string> findings;
  const auto tell = [&](const Finding& finding) { findings.push_back(finding.what); };
  const auto copy = repair_journal(disk, "j", "mended", 0, {}, tell, {}).or_throw();
  EXPECT_EQ(copy.last, 3U);
  EXPECT_TRUE(copy.lost.empty());
  EXPECT_FALSE(copy.sound) << "with that segment, the journal would miss what it claims";
  EXPECT_FALSE(JournalLog::open(disk, "j", 0, {.read_only = true}).or_throw()->loss().ok());
  const auto mended = JournalLog::open(disk, "mended", 0, {}).or_throw();
  EXPECT_TRUE(mended->loss().ok()) << mended->loss().to_string();
  EXPECT_EQ(mended->last(), 3U);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_NE(findings[0].find("is left out"), std::string::npos) << findings[0];
}

// Nothing is known of what such a segment holds, so a journal that a daemon would not write to is not called sound.
TEST(JournalRepair, LeavesOutAFirstSegmentThatIsNotTheOneThatItsNameSays) {
  const auto disk = ForgetfulFiles::create(1);
  ASSERT_TRUE(disk->create_directory("j").ok());
  const auto file = disk->open_append("j/" + SegmentName{1, 7}.to_string()).or_throw();
  ByteWriter w;
  w.put_bytes(segment_header(1, 5));
  put_journal_record(w, 5, 1, 0, encode_record(IdleWorkRecord{1}, 0));
  ASSERT_TRUE(file->append(w.bytes()).ok() && file->sync().ok());
  EXPECT_FALSE(JournalLog::open(disk, "j", 0, {.read_only = true}).or_throw()->loss().ok());
  std::vector<std::string> findings;
  const auto tell = [&](const Finding& finding) { findings.push_back(finding.what); };
  const auto copy = repair_journal(disk, "j", "mended", 0, {}, tell, {}).or_throw();
  EXPECT_FALSE(copy.sound);
  EXPECT_EQ(copy.last, 0U);
  EXPECT_TRUE(JournalLog::open(disk, "mended", 0, {}).or_throw()->loss().ok());
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_NE(findings[0].find("is not the segment that its name says"), std::string::npos) << findings[0];
}

// Every other record of many sessions is lost: each session gets its gaps, before its next record, and nothing else
// changes.
TEST(JournalRepair, FillsManyHolesWithTheGapsOfManySessions) {
  const auto disk = ForgetfulFiles::create(1);
  std::vector<std::uint64_t> offsets;
  std::string path;
  constexpr std::uint32_t kSessions = 20, kRounds = 30;
  std::vector<Session> sessions(kSessions);
  {
    const auto log = JournalLog::open(disk, "j", 0, {.segment_bytes = 1 << 24}).or_throw();
    path = "j/" + disk->list("j").value().front();
    for (std::uint32_t round = 0; round < kRounds; ++round)
      for (std::uint32_t s = 1; s <= kSessions; ++s) {
        offsets.push_back(disk->open_read(path).value()->size());
        const Bytes record = encode_record(RefusalRecord{s, round, 1, Reason::BAD_SIZE}, log->last());
        ASSERT_TRUE(log->append({&record, 1}).ok());
      }
  }
  for (std::uint32_t s = 1; s <= kSessions; ++s) sessions[s - 1].number = s;
  // Session s loses its records of the rounds with (round + s) % 3 == 0, but for the last round.
  for (std::uint32_t round = 0; round + 1 < kRounds; ++round)
    for (std::uint32_t s = 1; s <= kSessions; ++s)
      if ((round + s) % 3 == 0) disk->damage(path, offsets[round * kSessions + s - 1] + 9);
  const auto copy = repair_journal(disk, "j", "mended", 0, sessions, {}, {}).or_throw();
  EXPECT_EQ(copy.last, kSessions * kRounds);
  std::vector<std::uint32_t> next(kSessions + 1, 0);
  const auto mended = JournalLog::open(disk, "mended", 0).or_throw();
  ASSERT_TRUE(mended
                  ->read(1,
                         [&](std::uint64_t, ByteSpan bytes) {
                           const auto decoded = decode_record(bytes).or_throw();
                           if (const auto* gap = std::get_if<GapRecord>(&decoded.record)) {
                             EXPECT_EQ(gap->from, next[gap->session]);
                             EXPECT_EQ((gap->from + gap->session) % 3, 0U);
                             EXPECT_EQ(gap->to, gap->from) << "of session " << gap->session;
                             next[gap->session] = gap->to + 1;
                           } else if (const auto* refusal = std::get_if<RefusalRecord>(&decoded.record)) {
                             EXPECT_EQ(refusal->sequence, next[refusal->session]++);
                           }
                           return true;
                         })
                  .ok());
  for (std::uint32_t s = 1; s <= kSessions; ++s) EXPECT_EQ(next[s], kRounds) << s;
}

}  // namespace
}  // namespace relmap::storage
