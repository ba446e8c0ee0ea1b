#include "frontend/capture/raw_log_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "frontend/capture/testing/raw_logs.h"
#include "proto/base/crc32c.h"

namespace relmap::capture {
namespace {

using testing_files::raw_frame;
using testing_files::raw_header;
using testing_files::read_all;
using testing_files::read_bytes;
using testing_files::TemporaryFolder;
using testing_files::write_bytes;
using testing_files::write_raw_log;

std::vector<std::uint64_t> up_to(std::uint64_t count) {
  std::vector<std::uint64_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// A log of six small frames with a fault before the fourth, in a folder of its own.
class RawLog : public testing::Test {
 protected:
  void SetUp() override {
    write_raw_log(path_, raw_header(4, 2), 6, 3);
    bytes_ = read_bytes(path_);
    index_ = read_bytes(index_path_);
    auto log = RawLogReader::open(path_);
    ASSERT_TRUE(log.ok()) << log.status().to_string();
    entries_ = log->index();
    ASSERT_EQ(entries_.size(), 2u + 6u + 1u);
  }
  Result<RawLogReader> open_as(ByteSpan log, ByteSpan index = {}) {
    write_bytes(path_, log);
    std::filesystem::remove(index_path_);
    if (!index.empty()) write_bytes(index_path_, index);
    return RawLogReader::open(path_);
  }

  TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "drive.raw").string(), index_path_ = path_ + ".idx";
  Bytes bytes_, index_;
  RawLogIndex entries_;
};

TEST_F(RawLog, GivesBackAllThatWasWritten) {
  auto log = RawLogReader::open(path_);
  ASSERT_TRUE(log.ok()) << log.status().to_string();
  const RawLogHeader written = raw_header(4, 2);
  EXPECT_EQ(log->header().vendor, written.vendor);
  EXPECT_EQ(log->header().model, written.model);
  EXPECT_EQ(log->header().serial, written.serial);
  EXPECT_EQ(log->header().layout, written.layout);
  EXPECT_EQ(log->header().embedded, written.embedded);
  EXPECT_EQ(log->header().rate_hz, written.rate_hz);
  EXPECT_EQ(log->header().begun_us, written.begun_us);
  EXPECT_FALSE(log->header().calibration);
  EXPECT_EQ(log->frames(), 6u);
  EXPECT_EQ(log->torn_bytes(), 0u);
  const auto whole = read_all(*log);
  EXPECT_EQ(whole.frames, up_to(6));
  EXPECT_TRUE(whole.errors.empty());
  ASSERT_EQ(whole.events.size(), 1u);
  EXPECT_EQ(whole.events[0].reason, Reason::CAMERA_STALLED);
  EXPECT_EQ(whole.events[0].message, "endpoint 2 halted");
  EXPECT_EQ(whole.events[0].lost, 3u);
  EXPECT_EQ(whole.events[0].time_us, raw_frame(3).time_us - 1);
}

TEST_F(RawLog, IsKnownByItsFirstBytes) {
  EXPECT_TRUE(is_raw_log(path_));
  EXPECT_FALSE(is_raw_log(index_path_));
  EXPECT_FALSE(is_raw_log(folder_.path().string()));
  EXPECT_EQ(RawLogReader::open(path_ + "x").reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(RawLogReader::open(index_path_).reason(), Reason::CORRUPT);
  Bytes later = bytes_;
  later[8] = 2;
  EXPECT_EQ(open_as(later).reason(), Reason::UNKNOWN_FORMAT_VERSION);
}

TEST_F(RawLog, SeeksByNumberAndTime) {
  auto log = RawLogReader::open(path_);
  ASSERT_TRUE(log.ok());
  const auto next_frame = [&] { return std::get<RawLogReader::Frame>(**log->next()).frame.index; };
  log->seek(4);
  EXPECT_EQ(next_frame(), 4u);
  log->seek(0);
  EXPECT_EQ(next_frame(), 0u);
  log->skip_before(raw_frame(4).time_us);
  EXPECT_EQ(next_frame(), 4u);
  log->skip_before(raw_frame(2).time_us);  // never back
  EXPECT_EQ(next_frame(), 5u);
  log->seek(1);
  log->skip_before(raw_frame(2).time_us + 1);
  EXPECT_TRUE(std::holds_alternative<RawLogEvent>(**log->next()));  // it stands before the fourth
  EXPECT_EQ(next_frame(), 3u);
  log->skip_before(raw_frame(100).time_us);
  EXPECT_FALSE(*log->next());
  log->seek(6);
  EXPECT_FALSE(*log->next());
}

TEST_F(RawLog, TruncatedAnywhereReturnsAllCompleteRecords) {
  for (const bool with_index : {false, true})
    for (std::size_t size = 0; size < bytes_.size(); size += with_index ? 5 : 1) {
      SCOPED_TRACE("cut at " + std::to_string(size));
      auto log = open_as(ByteSpan(bytes_).first(size), with_index ? ByteSpan(index_) : ByteSpan());
      if (size < entries_[0].end()) {
        ASSERT_EQ(log.reason(), Reason::CORRUPT);
        continue;
      }
      ASSERT_TRUE(log.ok()) << log.status().to_string();
      std::uint64_t frames = 0, end = 0;
      for (const RawLogEntry& entry : entries_) {
        if (entry.end() > size) break;
        frames += entry.kind == raw_log::Kind::kFrame;
        end = entry.end();
      }
      const auto whole = read_all(*log);
      ASSERT_EQ(whole.frames, up_to(frames));
      ASSERT_TRUE(whole.errors.empty());
      ASSERT_EQ(log->torn_bytes(), size - end);
    }
}

TEST_F(RawLog, AFlippedByteLosesAtMostOneRecordAndIsReported) {
  for (const bool with_index : {false, true})
    for (std::size_t at = raw_log::kBeginBytes; at < bytes_.size(); at += with_index ? 5 : 1) {
      SCOPED_TRACE("byte " + std::to_string(at));
      Bytes flipped = bytes_;
      flipped[at] ^= static_cast<std::uint8_t>(1 << at % 8);
      auto log = open_as(flipped, with_index ? ByteSpan(index_) : ByteSpan());
      ASSERT_TRUE(log.ok()) << log.status().to_string();
      const auto whole = read_all(*log);
      const auto hit =
          std::find_if(entries_.begin(), entries_.end(), [&](const RawLogEntry& entry) { return at < entry.end(); });
      std::vector<std::uint64_t> left = up_to(6);
      if (hit->kind == raw_log::Kind::kFrame) std::erase(left, hit->number);
      ASSERT_EQ(whole.frames, left);
      ASSERT_EQ(whole.events.size(), hit->kind == raw_log::Kind::kEvent ? 0u : 1u);
      if (hit + 1 == entries_.end() && whole.errors.empty()) {  // a damaged end is a torn one
        ASSERT_EQ(log->torn_bytes(), bytes_.size() - hit->offset);
        continue;
      }
      ASSERT_EQ(whole.errors.size(), 1u);
      ASSERT_EQ(whole.errors[0].reason(), Reason::CORRUPT);
      ASSERT_NE(whole.errors[0].message().find("byte " + std::to_string(hit->offset)), std::string::npos)
          << whole.errors[0].to_string();
    }
}

TEST_F(RawLog, ContinuesAfterADamagedStretch) {
  Bytes damaged = bytes_;
  const std::size_t from = entries_[3].offset + 10, to = entries_[5].offset + 3;  // two frames, and a head's sync word
  std::fill(damaged.begin() + static_cast<std::ptrdiff_t>(from), damaged.begin() + static_cast<std::ptrdiff_t>(to), 0);
  auto log = open_as(damaged);
  ASSERT_TRUE(log.ok());
  auto whole = read_all(*log);
  EXPECT_EQ(whole.frames, (std::vector<std::uint64_t>{0, 3, 4, 5}));
  ASSERT_EQ(whole.errors.size(), 1u);
  EXPECT_EQ(whole.errors[0].message(), path_ + ", byte " + std::to_string(entries_[3].offset) + ": " +
                                           std::to_string(entries_[6].offset - entries_[3].offset) +
                                           " bytes are damaged, and passed over");

  Bytes cut = bytes_;  // of bytes that never came, the next head is found
  cut.erase(cut.begin() + static_cast<std::ptrdiff_t>(entries_[3].offset + 45),
            cut.begin() + static_cast<std::ptrdiff_t>(entries_[3].offset + 55));
  log = open_as(cut);
  ASSERT_TRUE(log.ok());
  whole = read_all(*log);
  EXPECT_EQ(whole.frames, (std::vector<std::uint64_t>{0, 3, 4, 5}));
  EXPECT_EQ(whole.errors.size(), 2u);
}

TEST_F(RawLog, PassesOverRecordsOfLaterVersions) {
  raw_log::Head head;
  head.kind = static_cast<raw_log::Kind>(9);
  head.bytes = 3;
  const Bytes body = {1, 2, 3};
  head.crc = crc32c(body);
  Bytes log_bytes = bytes_;
  const Bytes later = raw_log::encode_head(head);
  const auto at = static_cast<std::ptrdiff_t>(entries_[4].offset);
  log_bytes.insert(log_bytes.begin() + at, body.begin(), body.end());
  log_bytes.insert(log_bytes.begin() + at, later.begin(), later.end());
  auto log = open_as(log_bytes);
  ASSERT_TRUE(log.ok());
  const auto whole = read_all(*log);
  EXPECT_EQ(whole.frames, up_to(6));
  EXPECT_TRUE(whole.errors.empty());
}

TEST_F(RawLog, RefusesHeadersThatAreOfNoCamera) {
  for (const auto& [width, height] : {std::pair{0, 4}, {-1, -1}, {20000, 4}, {16384, 16384}}) {
    RawLogHeader header = raw_header(4, 2);
    header.layout.width = width, header.layout.height = height;
    const Bytes body = raw_log::encode_header(header);
    raw_log::Head head;
    head.kind = raw_log::Kind::kHeader;
    head.bytes = static_cast<std::uint32_t>(body.size());
    head.crc = crc32c(body);
    ByteWriter log;
    log.put_bytes(raw_log::encode_begin());
    log.put_bytes(raw_log::encode_head(head));
    log.put_bytes(body);
    EXPECT_EQ(open_as(log.bytes()).reason(), Reason::BAD_SIZE) << width << " x " << height;
  }
}

TEST_F(RawLog, IndexIsTheSameByWriterAndReader) {
  EXPECT_EQ(read_bytes(index_path_), index_);  // opening did not change it
  EXPECT_EQ(parse_raw_log_index(index_), entries_);
  auto log = open_as(bytes_);
  ASSERT_TRUE(log.ok());
  EXPECT_EQ(read_bytes(index_path_), index_);  // and made it again where it was missing
}

TEST_F(RawLog, IndexThatIsDamagedCutOrOfAnotherLogIsMadeAgain) {
  const auto expect_mended = [&](const Bytes& index) {
    auto log = open_as(bytes_, index);
    ASSERT_TRUE(log.ok());
    ASSERT_EQ(log->index(), entries_);
    ASSERT_EQ(read_bytes(index_path_), index_);
  };
  for (std::size_t i = 0; i < index_.size(); i += 3) {
    SCOPED_TRACE("byte " + std::to_string(i));
    Bytes flipped = index_;
    flipped[i] ^= 0x20;
    expect_mended(flipped);
    if (i > 0) expect_mended(Bytes(index_.begin(), index_.begin() + static_cast<std::ptrdiff_t>(i)));
  }
  RawLogHeader other = raw_header(4, 2);
  other.begun_us += 1;
  const std::string other_path = path_ + "2";
  write_raw_log(other_path, other, 6, 3);
  expect_mended(read_bytes(other_path + ".idx"));
  write_raw_log(path_ + "3", raw_header(4, 2), 9, 3);  // one that knows more than there is
  expect_mended(read_bytes(path_ + "3.idx"));
  expect_mended(Bytes(1 << 20, 7));
}

TEST_F(RawLog, IndexIsExtendedWhenTheLogHasGrown) {
  const auto half = static_cast<std::size_t>(entries_[5].end());
  ASSERT_TRUE(open_as(ByteSpan(bytes_).first(half)).ok());
  const Bytes index_of_half = read_bytes(index_path_);
  EXPECT_LT(index_of_half.size(), index_.size());
  auto log = open_as(bytes_, index_of_half);
  ASSERT_TRUE(log.ok());
  EXPECT_EQ(log->index(), entries_);
  EXPECT_EQ(read_bytes(index_path_), index_);
}

TEST_F(RawLog, WorksWithoutAWritableIndex) {
  std::filesystem::remove(index_path_);
  std::filesystem::create_directories(index_path_ + "/not empty");
  auto log = RawLogReader::open(path_);
  ASSERT_TRUE(log.ok()) << log.status().to_string();
  EXPECT_EQ(log->index(), entries_);
}

}  // namespace
}  // namespace relmap::capture
