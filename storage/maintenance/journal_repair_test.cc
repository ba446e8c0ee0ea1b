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

}  // namespace
}  // namespace relmap::storage
