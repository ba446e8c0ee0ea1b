#include "storage/journal/journal_log.h"

#include <gtest/gtest.h>

#include <random>

#include "proto/base/crc32c.h"
#include "storage/journal/journal_segment.h"
#include "storage/testing/faulty_files.h"
#include "storage/testing/forgetful_files.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kHeader = 32;  // of a segment, and of a record

Bytes record_of(std::uint64_t sequence, std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(sequence * 31 + i);
  return bytes;
}

// Segments of version 1.
Bytes unsalted_header(std::uint64_t first) {
  ByteWriter w;
  w.put(std::uint32_t{0x4c4a4d52});
  w.put(std::uint16_t{1});
  w.put(std::uint16_t{0});
  w.put(first);
  w.put(std::uint32_t{0});
  w.put(crc32c(w.bytes()));
  return w.take();
}
Bytes unsalted_record(std::uint64_t sequence, std::uint64_t acknowledged_through, const Bytes& payload) {
  ByteWriter sums;
  sums.put(static_cast<std::uint32_t>(payload.size()));
  sums.put(sequence);
  sums.put(acknowledged_through);
  sums.put_bytes(payload);
  ByteWriter w;
  w.put(static_cast<std::uint32_t>(payload.size()));
  w.put(crc32c(sums.bytes()));
  w.put_bytes(ByteSpan(sums.bytes()).subspan(4));
  return w.take();
}

struct JournalLogTest : ::testing::Test {
  std::shared_ptr<ForgetfulFiles> disk = ForgetfulFiles::create(1);
  std::mt19937_64 random{7};
  std::function<std::uint64_t()> salts = [this] { return random(); };

  std::unique_ptr<JournalLog> open(std::uint64_t applied = 0, std::uint64_t segment_bytes = 1000) {
    return JournalLog::open(disk, "j", applied, {segment_bytes, false, salts}).value();
  }
  static void append(JournalLog& log, std::uint64_t count, std::size_t size = 100) {
    for (std::uint64_t i = 0; i < count; ++i) {
      const Bytes record = record_of(log.last() + 1, size);
      ASSERT_TRUE(log.append({&record, 1}).ok());
    }
  }
  // Sequences read, each checked to be its own record.
  static std::vector<std::uint64_t> read(const JournalLog& log, std::uint64_t from, Status* status = nullptr) {
    std::vector<std::uint64_t> sequences;
    const Status got = log.read(from, [&](std::uint64_t sequence, ByteSpan record) {
      EXPECT_EQ(Bytes(record.begin(), record.end()), record_of(sequence, record.size()));
      sequences.push_back(sequence);
      return true;
    });
    if (status)
      *status = got;
    else
      EXPECT_TRUE(got.ok()) << got.to_string();
    return sequences;
  }
  void write_file(const std::string& name, const Bytes& bytes) {
    ASSERT_TRUE(disk->create_directory("j").ok());
    const auto file = disk->open_append("j/" + name).value();
    ASSERT_TRUE(file->append(bytes).ok());
    ASSERT_TRUE(file->sync().ok());
    ASSERT_TRUE(disk->sync_directory("j").ok());
  }
  std::vector<std::string> segments() const { return disk->list("j").value(); }
  std::string segment(std::size_t i) const { return "j/" + segments().at(i); }
};

TEST_F(JournalLogTest, RollsOverToNewSegmentsAndTrimsWholeOnes) {
  auto log = open();
  append(*log, 50);
  EXPECT_GT(segments().size(), 4u);
  const std::size_t before = segments().size();
  ASSERT_TRUE(log->trim(30).ok());
  EXPECT_LT(segments().size(), before);
  EXPECT_EQ(log->first(), 31u);
  EXPECT_EQ(read(*log, 1).size(), 20u);
  ASSERT_TRUE(log->trim(50).ok());
  EXPECT_EQ(segments().size(), 1u);
  log = open(50);
  EXPECT_EQ(log->last(), 50u);
  append(*log, 1);
  EXPECT_EQ(log->last(), 51u);
}

TEST_F(JournalLogTest, SegmentsLeftByACrashBeforeTheTrimDoNoHarm) {
  auto log = open();
  append(*log, 50);
  log = open(40);  // committed, never trimmed
  EXPECT_EQ(log->first(), 41u);
  EXPECT_EQ(read(*log, 1).size(), 10u);
  ASSERT_TRUE(log->trim(40).ok());
  EXPECT_EQ(read(*log, 1).size(), 10u);
}

TEST_F(JournalLogTest, ATailThatWasNotAcknowledgedIsDropped) {
  auto log = open();
  append(*log, 5);
  disk->damage(segment(0), kHeader + 4 * (kHeader + 100) + 50);  // in the fifth: no later record vouches for it
  log = open();
  EXPECT_TRUE(log->loss().ok());
  EXPECT_NE(log->dropped().find("from 5"), std::string::npos) << log->dropped();
  EXPECT_EQ(read(*log, 1).size(), 4u);
  append(*log, 3);
  log = open();
  EXPECT_TRUE(log->dropped().empty());
  EXPECT_EQ(read(*log, 1).size(), 7u);
}

TEST_F(JournalLogTest, DamageBelowAnAcknowledgedRecordIsALossWithItsRange) {
  for (const std::uint64_t damaged : {1u, 2u, 4u}) {
    disk = ForgetfulFiles::create(1);
    auto log = open();
    append(*log, 5);
    disk->damage(segment(0), kHeader + (damaged - 1) * (kHeader + 100) + 50);
    log = open();
    ASSERT_EQ(log->loss().reason(), Reason::DATA_LOSS);
    EXPECT_NE(log->loss().message().find(std::to_string(damaged) + "..4"), std::string::npos) << log->loss().message();
    Status status;
    EXPECT_EQ(read(*log, 1, &status).size(), damaged - 1);
    EXPECT_EQ(status.reason(), Reason::DATA_LOSS);
    const Bytes record{1};
    EXPECT_EQ(log->append({&record, 1}).reason(), Reason::DATA_LOSS);
    // Nothing was repaired: the next start says the same.
    EXPECT_EQ(open()->loss().message(), log->loss().message());
  }
}

TEST_F(JournalLogTest, AnyFlippedBitIsHarmlessOrReportedOrInTheLastRecord) {
  auto log = open(0, 300);
  append(*log, 8, 40);
  for (std::size_t i = 0; i < segments().size(); ++i) {
    const std::string path = segment(i);
    const std::uint64_t size = disk->open_read(path).value()->size();
    for (std::uint64_t at = 0; at < size; ++at) {
      disk->damage(path, at);
      const auto damaged = JournalLog::open(disk, "j", 0, {300, true});
      if (damaged.ok()) {
        const JournalLog& found = **damaged;
        const bool in_header = at < kHeader;
        const bool harmless = found.loss().ok() && found.last() == 8u;
        const bool named = !found.loss().ok();
        const bool of_the_last = found.loss().ok() && found.last() == 7u && !found.dropped().empty();
        EXPECT_TRUE(in_header ? harmless : named || of_the_last) << path << " " << at;
      } else {
        EXPECT_EQ(damaged.reason(), Reason::UNKNOWN_FORMAT_VERSION);
      }
      disk->damage(path, at);
    }
  }
}

TEST_F(JournalLogTest, DamageToAppliedRecordsDoesNotMatter) {
  auto log = open();
  append(*log, 30);
  disk->damage(segment(0), kHeader + 50);
  log = open(5);
  EXPECT_TRUE(log->loss().ok()) << log->loss().to_string();
  EXPECT_EQ(read(*log, 6).size(), 25u);
  append(*log, 1);
  EXPECT_EQ(open(5)->last(), 31u);
}

// The search for records looks no further ahead than 2^24 of them, counted from where the segment begins.
TEST_F(JournalLogTest, DamageToAppliedRecordsDoesNotMatterHoweverManyThereWere) {
  const std::uint64_t before = std::uint64_t{1} << 25;
  auto log = open(before);
  append(*log, 5);
  disk->damage(segment(0), kHeader + 50);
  log = open(before + 1);
  EXPECT_TRUE(log->loss().ok()) << log->loss().to_string();
  EXPECT_EQ(log->last(), before + 5);
  EXPECT_EQ(read(*log, before + 2).size(), 4u);
}

TEST_F(JournalLogTest, AMissingSegmentInTheMiddleIsALoss) {
  auto log = open();
  append(*log, 50);
  ASSERT_TRUE(disk->remove(segment(2)).ok());
  log = open();
  EXPECT_EQ(log->loss().reason(), Reason::DATA_LOSS);
  EXPECT_EQ(open(49)->last(), 50u);  // not needed, no loss
}

TEST_F(JournalLogTest, SequencesContinueAfterAppliedWhenTheJournalIsGone) {
  auto log = open(7);
  EXPECT_EQ(log->last(), 7u);
  append(*log, 1);
  EXPECT_EQ(log->last(), 8u);
  log.reset();
  log = open(100);
  append(*log, 1);
  EXPECT_EQ(log->last(), 101u);
  EXPECT_EQ(read(*open(100), 101).size(), 1u);
}

TEST_F(JournalLogTest, AFailedSyncLeavesNoTraceOfItsRecords) {
  auto log = open();
  append(*log, 3);
  disk->fail_syncs(1);
  const Bytes lost = record_of(999, 100);
  EXPECT_EQ(log->append({&lost, 1}).reason(), Reason::IO_ERROR);
  EXPECT_EQ(log->last(), 3u);
  append(*log, 2);
  EXPECT_EQ(read(*log, 1).size(), 5u);
  disk->restart();
  EXPECT_EQ(read(*open(), 1).size(), 5u);
}

TEST_F(JournalLogTest, NothingAcknowledgedIsLostOrDoubledWhenSyncsAndThenThePowerFail) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    disk = ForgetfulFiles::create(seed);
    auto log = open();
    append(*log, 1 + seed % 12);
    const std::uint64_t acknowledged = log->last();
    disk->fail_syncs(1 + static_cast<int>(seed % 4));  // also of the cut and of the next segment's header
    const Bytes failed = record_of(acknowledged + 1, 3000);
    EXPECT_EQ(log->append({&failed, 1}).reason(), Reason::IO_ERROR);
    while (!log->append({}).ok()) continue;
    if (seed % 2 == 0) {
      append(*log, 3, 100);
      ASSERT_EQ(log->last(), acknowledged + 3);
    }
    const std::uint64_t durable = log->last();
    EXPECT_EQ(read(*log, 1).size(), durable);
    disk->restart();
    EXPECT_EQ(read(*open(), 1).size(), durable) << "seed " << seed;
  }
}

TEST_F(JournalLogTest, AfterAFailedSyncTheNextSegmentIsBegun) {
  auto log = open();
  append(*log, 3);
  disk->fail_syncs(2);
  const Bytes failed = record_of(4, 100);
  EXPECT_FALSE(log->append({&failed, 1}).ok());
  append(*log, 1);
  ASSERT_EQ(segments().size(), 2u);
  EXPECT_NE(segment(1).find("0004-"), std::string::npos);
  append(*log, 1);
  // The same at a segment's first record: its file is made anew, even if that fails once.
  disk->fail_syncs(1);
  EXPECT_FALSE(log->append({&failed, 1}).ok());
  EXPECT_TRUE(log->append({}).ok());
  ASSERT_EQ(segments().size(), 3u);
  disk->fail_syncs(1);
  EXPECT_FALSE(log->append({&failed, 1}).ok());
  disk->fail_syncs(1);
  EXPECT_FALSE(log->append({}).ok());
  append(*log, 2);
  ASSERT_EQ(segments().size(), 3u);
  EXPECT_EQ(read(*log, 1).size(), 7u);
  disk->restart();
  EXPECT_EQ(read(*open(), 1).size(), 7u);
}

TEST_F(JournalLogTest, WhatAKilledProcessDidNotSyncIsSyncedBeforeItCounts) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    disk = ForgetfulFiles::create(seed);
    auto log = open();
    append(*log, 2);
    disk->fail_power_after(2);  // written, and killed before the sync
    const Bytes record = record_of(3, 100);
    ASSERT_FALSE(log->append({&record, 1}).ok());
    disk->kill();
    log = open();
    const std::uint64_t last = log->last();
    EXPECT_EQ(last, 3u);
    disk->restart();
    EXPECT_EQ(open()->last(), last) << "seed " << seed;
  }
}

TEST_F(JournalLogTest, ASegmentThatCannotBeReadIsALossThatNamesIt) {
  auto log = open();
  append(*log, 30);
  const auto faults = std::make_shared<DiskFaults>();
  const auto files = faulty_files(disk, faults);
  faults->read = Reason::IO_ERROR;
  const auto broken = JournalLog::open(files, "j", 0, {1000, true});
  ASSERT_TRUE(broken.ok()) << broken.status().to_string();
  EXPECT_EQ((*broken)->loss().reason(), Reason::DATA_LOSS);
  EXPECT_NE((*broken)->loss().message().find("journal-0000"), std::string::npos) << (*broken)->loss().message();
  const Bytes record{1};
  EXPECT_EQ((*broken)->append({&record, 1}).reason(), Reason::DATA_LOSS);
}

TEST_F(JournalLogTest, AFullDiskIsReportedAndAppendsGoOnOnceThereIsRoom) {
  const auto faults = std::make_shared<DiskFaults>();
  const auto log = JournalLog::open(faulty_files(disk, faults), "j", 0, {1000, false}).value();
  append(*log, 3);
  faults->write = Reason::DISK_FULL;
  const Bytes failed = record_of(4, 100);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(log->append({&failed, 1}).reason(), Reason::DISK_FULL);
  EXPECT_EQ(log->append({}).reason(), Reason::DISK_FULL);
  EXPECT_EQ(read(*log, 1).size(), 3u);
  faults->write = Reason::OK;
  append(*log, 3);
  EXPECT_EQ(read(*log, 1).size(), 6u);
  EXPECT_EQ(read(*open(), 1).size(), 6u);
}

// The file of a segment whose header never reached the disk is removed at the next start. Were it to come back, it
// would overtake what is written to the segment before it.
TEST_F(JournalLogTest, ARemovedSegmentDoesNotComeBackToOvertakeWhatIsWrittenLater) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    disk = ForgetfulFiles::create(seed);
    append(*open(), 5);
    ASSERT_TRUE(disk->open_append("j/" + SegmentName{6, salts()}.to_string()).ok());
    ASSERT_TRUE(disk->sync_directory("j").ok());
    append(*open(), 2);
    disk->restart();
    EXPECT_EQ(open()->last(), 7u) << "seed " << seed;
  }
}

TEST_F(JournalLogTest, AnUnknownVersionIsRefusedByName) {
  ByteWriter w;
  w.put(std::uint32_t{0x4c4a4d52});
  w.put(std::uint16_t{9});
  w.put(std::uint16_t{0});
  w.put(std::uint64_t{1});
  w.put(std::uint64_t{5});
  w.put(std::uint32_t{0});
  w.put(crc32c(w.bytes()));
  write_file(SegmentName{1, 5}.to_string(), w.bytes());
  EXPECT_EQ(JournalLog::open(disk, "j", 0).reason(), Reason::UNKNOWN_FORMAT_VERSION);
}

// The worst that a payload can hold: a record that is sound in all but its salt, has the next sequence, and says that
// records were acknowledged that never existed.
TEST_F(JournalLogTest, ARecordInsideAPayloadIsNeverTakenForOne) {
  append(*open(), 12);  // whoever has a backup knows the salts of its segments
  Bytes forged = unsalted_record(15, 14, record_of(15, 20));
  std::vector<std::uint64_t> guesses = {0, ~std::uint64_t{0}, 0x0123456789abcdef};
  for (const std::string& name : segments()) guesses.push_back(*SegmentName::parse(name)->salt);
  for (const std::uint64_t guess : guesses) {
    ByteWriter w;
    put_journal_record(w, guess, 15, 14, record_of(15, 20));
    forged.insert(forged.end(), w.bytes().begin(), w.bytes().end());
  }
  for (const bool told : {false, true}) {
    disk = ForgetfulFiles::create(1);
    auto log = open(0, 100000);
    append(*log, 12);
    ASSERT_TRUE(log->append({&forged, 1}).ok());
    const std::uint64_t at = disk->open_read(segment(0)).value()->size() - forged.size() - kHeader;
    if (told) append(*log, 1);
    disk->damage(segment(0), at + 9);  // its length field, so that the payload is searched
    log = open();
    EXPECT_EQ(log->last(), 12U);
    if (told) {
      EXPECT_NE(log->loss().message().find("13..13 were durable"), std::string::npos) << log->loss().message();
    } else {
      EXPECT_TRUE(log->loss().ok()) << log->loss().to_string();
      EXPECT_NE(log->dropped().find("from 13"), std::string::npos) << log->dropped();
    }
    EXPECT_EQ(SegmentReader::open(*disk, segment(0)).value().find_after(at + kHeader, 12)->has_value(), told);
  }
}

// A robot fills its keyframes with records that are sound in all but the salt: under salts of older segments, guesses,
// and the right one but for a bit. Wherever the power fails in the last record, and whatever stands there then, they
// are never read as records, and never as a sign that something is missing.
TEST_F(JournalLogTest, TornTailsBehindForgedRecordsAreOnlyCutOff) {
  std::vector<std::uint64_t> old_salts;
  for (std::uint64_t seed = 0; seed < 10'000; ++seed) {
    disk = ForgetfulFiles::create(seed);
    std::uint64_t salt = 0;
    const auto draw = [&] { return salt = random(); };
    auto log = JournalLog::open(disk, "j", 0, {seed % 3 == 0 ? 400u : 100'000u, false, draw}).value();
    const auto forged = [&](std::uint64_t sequence) {
      ByteWriter w;
      std::vector<std::uint64_t> guesses{0, ~std::uint64_t{0}, random(), salt ^ std::uint64_t{1} << random() % 64};
      if (!old_salts.empty()) guesses.push_back(old_salts[random() % old_salts.size()]);
      for (std::uint64_t ahead = 0; ahead < 2; ++ahead)
        for (const std::uint64_t guess : guesses)
          put_journal_record(w, guess, sequence + ahead, sequence + ahead - 1, record_of(sequence, random() % 40));
      return w.take();
    };
    const std::uint64_t whole = 1 + random() % 4;
    for (std::uint64_t i = 0; i < whole; ++i) {
      const Bytes record = forged(log->last() + 1 + random() % 2);
      ASSERT_TRUE(log->append({&record, 1}).ok());
    }
    const std::string begun = segment(segments().size() - 1);
    const std::uint64_t end = disk->open_read(begun).value()->size();
    const Bytes last = forged(whole + 1);
    ASSERT_TRUE(log->append({&last, 1}).ok());
    log.reset();
    const std::string path = segment(segments().size() - 1);
    const std::uint64_t size = disk->open_read(path).value()->size();
    const std::uint64_t from = path == begun ? end : kHeader;
    if (seed % 2 == 0) {  // cut off within the last record
      ASSERT_TRUE(disk->truncate(path, from + random() % (size - from)).ok());
    } else if (seed % 4 == 1) {  // the sector with its head is not there
      disk->damage(path, from + random() % kHeader);
    } else {  // forged bytes stand where the next record was to begin
      ASSERT_TRUE(disk->truncate(path, from).ok());
      const auto file = disk->open_append(path).value();
      ASSERT_TRUE(file->append(forged(whole + 1)).ok() && file->sync().ok());
    }
    log = JournalLog::open(disk, "j", 0, {100'000, false, draw}).value();
    ASSERT_EQ(log->last(), whole) << seed;
    ASSERT_TRUE(log->loss().ok()) << seed << ": " << log->loss().to_string();
    std::uint64_t read = 0;
    ASSERT_TRUE(log->read(1, [&](std::uint64_t, ByteSpan) { return ++read > 0; }).ok());
    ASSERT_EQ(read, whole) << seed;
    old_salts.push_back(salt);
  }
}

// A payload in a segment without a salt can look like half a million heads of long records. Each is tried, and that
// takes no longer than reading the bytes a few times; tried one by one, this test would take an hour.
TEST_F(JournalLogTest, ASearchIsBoundedWhateverTheBytesSay) {
  ByteWriter w;
  w.put_bytes(unsalted_header(1));
  constexpr std::uint32_t kBytes = 16 << 20;
  while (w.size() < kBytes) {
    w.put(static_cast<std::uint32_t>((kBytes - w.size()) / 2));
    w.put(std::uint32_t{0});
    w.put(std::uint64_t{1000});
    w.put(std::uint64_t{999});
  }
  w.put_bytes(unsalted_record(7, 0, record_of(7, 100)));
  write_file("journal-00000000000000000001.log", w.bytes());
  const auto reader = SegmentReader::open(*disk, segment(0)).or_throw();
  const auto found = reader.find_after(reader.first_offset(), 0).or_throw();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sequence, 7U);
  EXPECT_EQ(found->payload, record_of(7, 100));
}

// Shows why segments have a salt.
TEST_F(JournalLogTest, WithoutASaltAForgedRecordWasTakenForOne) {
  ByteWriter w;
  w.put_bytes(unsalted_header(1));
  Bytes first = unsalted_record(1, 0, unsalted_record(2, 1, record_of(2, 20)));
  first[0] ^= 1;  // its length
  w.put_bytes(first);
  write_file("journal-00000000000000000001.log", w.bytes());
  const auto reader = SegmentReader::open(*disk, segment(0)).or_throw();
  const auto found = reader.find_after(reader.first_offset(), 0).or_throw();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sequence, 2U);
}

// Segments of version 1, as map format 2 wrote them, are read as they are; the journal goes on in a segment of version
// 2.
TEST_F(JournalLogTest, SegmentsWithoutASaltAreReadAndNotContinued) {
  ByteWriter w;
  w.put_bytes(unsalted_header(1));
  for (std::uint64_t i = 1; i <= 5; ++i) w.put_bytes(unsalted_record(i, i - 1, record_of(i, 100)));
  write_file("journal-00000000000000000001.log", w.bytes());
  auto log = open();
  EXPECT_TRUE(log->loss().ok()) << log->loss().to_string();
  EXPECT_EQ(read(*log, 1).size(), 5U);
  append(*log, 2);
  EXPECT_EQ(segments().size(), 2U);
  EXPECT_EQ(SegmentName::parse(segments()[1])->first, 6U);
  EXPECT_TRUE(SegmentName::parse(segments()[1])->salt);
  log = open();
  EXPECT_EQ(read(*log, 1).size(), 7U);
  append(*log, 1);
  EXPECT_EQ(segments().size(), 2U);
  ASSERT_TRUE(log->trim(5).ok());
  EXPECT_EQ(segments().size(), 1U);
  EXPECT_EQ(read(*open(5), 1).size(), 3U);
}

TEST_F(JournalLogTest, ATornTailOrAnEmptySegmentWithoutASaltDoesNoHarm) {
  for (const std::size_t records : {0U, 3U}) {
    disk = ForgetfulFiles::create(1);
    ByteWriter w;
    w.put_bytes(unsalted_header(1));
    for (std::uint64_t i = 1; i <= records; ++i) w.put_bytes(unsalted_record(i, i - 1, record_of(i, 100)));
    w.put_bytes(Bytes(70, 5));
    write_file("journal-00000000000000000001.log", w.bytes());
    auto log = open();
    EXPECT_TRUE(log->loss().ok()) << log->loss().to_string();
    EXPECT_EQ(log->last(), records);
    append(*log, 2);
    EXPECT_EQ(segments().size(), records == 0 ? 1U : 2U);
    log = open();
    EXPECT_TRUE(log->dropped().empty()) << log->dropped();
    EXPECT_EQ(read(*log, 1).size(), records + 2);
  }
}

TEST_F(JournalLogTest, ALostSectorAtTheHeadTakesNoMoreThanTheRecordsInIt) {
  auto log = open(0, 100000);
  append(*log, 30);
  for (std::uint64_t at = 0; at < 512; ++at) disk->damage(segment(0), at);
  log = open();
  EXPECT_NE(log->loss().message().find("1..29 were durable"), std::string::npos) << log->loss().message();
  EXPECT_EQ(open(4)->last(), 30U);  // those that are applied are not missed
  EXPECT_EQ(read(*open(4), 5).size(), 26U);
}

TEST_F(JournalLogTest, ASegmentUnderAnothersNameIsALossThatNamesIt) {
  append(*open(), 3);
  const auto file = disk->open_read(segment(0)).value();
  const Bytes bytes = file->read(0, file->size()).value();
  for (const SegmentName& name : {SegmentName{1, 5}, SegmentName{1, std::nullopt}}) {
    disk = ForgetfulFiles::create(1);
    write_file(name.to_string(), bytes);
    const auto log = open();
    EXPECT_EQ(log->loss().reason(), Reason::DATA_LOSS);
    EXPECT_NE(log->loss().message().find(name.to_string()), std::string::npos) << log->loss().message();
  }
}

// A segment whose first write failed is replaced by one of another salt; the power may fail between the two names.
TEST_F(JournalLogTest, TwoSegmentsOfOneSequenceAreSoundInEitherOrder) {
  for (const std::uint64_t left_behind : {std::uint64_t{1}, ~std::uint64_t{0}}) {
    disk = ForgetfulFiles::create(1);
    append(*open(), 3);
    const SegmentName empty{4, 77};
    write_file(empty.to_string(), segment_header(4, 77));
    ByteWriter w;
    w.put_bytes(segment_header(4, left_behind));
    put_journal_record(w, left_behind, 4, 3, record_of(4, 100));  // not acknowledged
    write_file(SegmentName{4, left_behind}.to_string(), w.bytes());
    auto log = open();
    EXPECT_TRUE(log->loss().ok()) << log->loss().to_string();
    append(*log, 2);
    const std::uint64_t last = log->last();
    EXPECT_GE(last, 5U);
    disk->fail_syncs(2);
    const Bytes failed = record_of(9, 100);
    EXPECT_FALSE(log->append({&failed, 1}).ok());
    append(*log, 2);
    log = open();
    EXPECT_TRUE(log->loss().ok()) << log->loss().to_string();
    EXPECT_EQ(read(*log, 1).size(), last + 2);
  }
}

}  // namespace
}  // namespace relmap::storage
