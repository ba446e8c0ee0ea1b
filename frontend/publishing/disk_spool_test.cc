#include "frontend/publishing/disk_spool.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap::publishing {
namespace {

namespace fs = std::filesystem;

class DiskSpoolTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "relmap_spool_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    header_ = sample_keyframe().session;
    header_.uuid = {};
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::unique_ptr<DiskSpool> open() {
    auto spool = DiskSpool::open(folder_.string(), header_);
    EXPECT_TRUE(spool.ok()) << spool.status().to_string();
    return spool.ok() ? std::move(*spool) : nullptr;
  }
  static Bytes payload(std::uint32_t sequence, std::size_t bytes = 100'000) {
    return Bytes(bytes, static_cast<std::uint8_t>(sequence));
  }
  static void append(DiskSpool& spool, std::uint32_t sequence, std::size_t bytes = 100'000) {
    const Bytes p = payload(sequence, bytes);
    ASSERT_TRUE(spool.append(sequence, p, crc32c(p)).ok());
  }
  std::vector<fs::path> segments() const {
    std::vector<fs::path> all;
    for (const auto& file : fs::directory_iterator(folder_))
      if (file.path().extension() == ".seg") all.push_back(file.path());
    std::sort(all.begin(), all.end());
    return all;
  }

  fs::path folder_;
  SessionHeader header_;
};

TEST_F(DiskSpoolTest, KeepsSessionKeyframesAndGaps) {
  SessionUuid uuid;
  {
    const auto spool = open();
    uuid = spool->session().uuid;
    EXPECT_FALSE(uuid.is_nil());
    append(*spool, 0);
    append(*spool, 3);
    ASSERT_TRUE(spool->append_gap({uuid, 1, 2, Reason::CAPTURE_FAILED}).ok());
  }
  const auto spool = open();
  EXPECT_EQ(spool->session().uuid, uuid);
  EXPECT_EQ(spool->session().camera, header_.camera);
  EXPECT_EQ(spool->keyframes().size(), 2u);
  EXPECT_EQ(*spool->read(3), payload(3));
  ASSERT_EQ(spool->gaps().size(), 1u);
  EXPECT_EQ(spool->gaps()[0].to, 2u);
  EXPECT_EQ(spool->gaps()[0].reason, Reason::CAPTURE_FAILED);
  EXPECT_EQ(spool->damaged_bytes(), 0u);
}

TEST_F(DiskSpoolTest, RemembersItsMapUntilItBeginsAnew) {
  const MapIdentity map{Uuid::random(), 1'764'000'000'000'000};
  SessionUuid uuid;
  {
    const auto spool = open();
    uuid = spool->session().uuid;
    EXPECT_FALSE(spool->map().known());
    append(*spool, 0);
    ASSERT_TRUE(spool->set_map(map).ok());
  }
  {
    const auto spool = open();
    EXPECT_EQ(spool->map(), map);
    append(*spool, 1);
    ASSERT_TRUE(spool->begin_anew().ok());
    EXPECT_FALSE(spool->map().known());
    EXPECT_TRUE(spool->keyframes().empty());
    append(*spool, 0);
  }
  EXPECT_EQ(segments().size(), 1u);
  EXPECT_EQ(open()->session().uuid, uuid);
  EXPECT_EQ(open()->keyframes().size(), 1u);
  // Though it ends before it holds anything anew; and another run of what went on in its midst is another session.
  ASSERT_TRUE(open()->begin_anew().ok());
  EXPECT_EQ(open()->session().uuid, uuid);
  ASSERT_TRUE(open()->mark_unrepeatable().ok());
  ASSERT_TRUE(open()->begin_anew().ok());
  const SessionUuid other = open()->session().uuid;
  EXPECT_NE(other, uuid);
  ASSERT_TRUE(open()->begin_anew().ok());
  EXPECT_EQ(open()->session().uuid, other);
  std::ofstream(folder_ / "map") << "nonsense\n";
  EXPECT_EQ(DiskSpool::open(folder_, header_).reason(), Reason::CORRUPT);
}

TEST_F(DiskSpoolTest, IsHeldByOneFrontEnd) {
  const auto spool = open();
  EXPECT_EQ(DiskSpool::open(folder_.string(), header_).reason(), Reason::FOLDER_LOCKED);
}

TEST_F(DiskSpoolTest, BelongsToOneSession) {
  SessionUuid uuid;
  {
    const auto spool = open();
    uuid = spool->session().uuid;
    append(*spool, 0);
  }
  SessionHeader other = header_;
  other.camera.f += 1;
  EXPECT_EQ(DiskSpool::open(folder_.string(), other).reason(), Reason::CALIBRATION_CHANGED);
  other = header_;
  other.robot = "another";
  EXPECT_EQ(DiskSpool::open(folder_.string(), other).reason(), Reason::INVALID_ARGUMENT);
  other = header_;
  other.uuid = SessionUuid::random();
  EXPECT_EQ(DiskSpool::open(folder_.string(), other).reason(), Reason::INVALID_ARGUMENT);
  other.uuid = uuid;
  EXPECT_TRUE(DiskSpool::open(folder_.string(), other).ok());
}

TEST_F(DiskSpoolTest, KeepsTheRawCalibrationOfItsSession) {
  header_.raw = sample_raw_calibration();
  append(*open(), 0);
  header_.raw = sample_raw_calibration(2);
  EXPECT_EQ(DiskSpool::open(folder_.string(), header_).reason(), Reason::CALIBRATION_CHANGED);
  header_.raw.reset();  // of a front-end that does not tell it: the session goes on as it began
  EXPECT_EQ(open()->session().raw, sample_raw_calibration());
}

// As front-ends wrote it before there was a raw calibration.
TEST_F(DiskSpoolTest, ReadsASessionOfVersion1) {
  SessionUuid uuid;
  {
    const auto spool = open();
    append(*spool, 0);
    uuid = spool->session().uuid;
  }
  const std::string path = folder_ / "session";
  std::ifstream in(path, std::ios::binary);
  Bytes bytes{std::istreambuf_iterator<char>(in), {}};
  in.close();
  bytes.resize(bytes.size() - 4 - 2);  // the checksum, and that there are no extensions
  bytes[4] = 1;
  ByteWriter older;
  older.put_bytes(bytes);
  older.put(crc32c(bytes));
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(older.bytes().data()), static_cast<std::streamsize>(older.bytes().size()));
  header_.raw = sample_raw_calibration();
  const auto spool = open();
  EXPECT_EQ(spool->session().uuid, uuid);
  EXPECT_EQ(spool->session().raw, std::nullopt);
}

TEST_F(DiskSpoolTest, BelongsToOneRecording) {
  append(*open(), 0);  // not said
  EXPECT_TRUE(DiskSpool::open(folder_.string(), header_, "the first drive").ok());
  EXPECT_TRUE(DiskSpool::open(folder_.string(), header_, "the first drive").ok());
  const auto other = DiskSpool::open(folder_.string(), header_, "another drive");
  EXPECT_EQ(other.reason(), Reason::INVALID_ARGUMENT);
  EXPECT_NE(other.status().message().find("the first drive"), std::string::npos) << other.status().message();
  EXPECT_TRUE(DiskSpool::open(folder_.string(), header_).ok());
}

TEST_F(DiskSpoolTest, BelongsToNoSessionBeforeItHeldAnything) {
  EXPECT_TRUE(DiskSpool::open(folder_.string(), header_, "the first drive").ok());
  SessionHeader other = header_;
  other.camera.f += 1;
  other.name = "another";
  const auto spool = DiskSpool::open(folder_.string(), other, "another drive");
  ASSERT_TRUE(spool.ok()) << spool.status().to_string();
  EXPECT_EQ((*spool)->session().name, "another");
}

TEST_F(DiskSpoolTest, HalfARecordAtTheEndIsDropped) {
  {
    const auto spool = open();
    for (std::uint32_t s = 0; s < 3; ++s) append(*spool, s);
  }
  fs::resize_file(segments().back(), fs::file_size(segments().back()) - 50'000);
  const auto spool = open();
  EXPECT_EQ(spool->keyframes().size(), 2u);
  EXPECT_GT(spool->damaged_bytes(), 0u);
  append(*spool, 2);  // into a segment of its own
  EXPECT_EQ(*spool->read(2), payload(2));
  EXPECT_EQ(segments().size(), 2u);
}

TEST_F(DiskSpoolTest, DamagedKeyframesAreNotReturned) {
  const auto spool = open();
  append(*spool, 0);
  std::fstream file(segments().front(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(50'000);
  file.put('\x55');
  file.close();
  EXPECT_EQ(spool->read(0).reason(), Reason::CORRUPT);
}

TEST_F(DiskSpoolTest, DamagedSessionIsNamed) {
  append(*open(), 0);
  std::fstream file(folder_ / "session", std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(30);
  file.put('\x55');
  file.close();
  EXPECT_EQ(DiskSpool::open(folder_.string(), header_).reason(), Reason::CORRUPT);
}

TEST_F(DiskSpoolTest, SegmentsAreDeletedWhenAllInThemIsSettled) {
  const auto spool = open();
  for (std::uint32_t s = 0; s < 200; ++s) append(*spool, s);
  const std::size_t full = segments().size();
  EXPECT_GE(full, 4u);
  ASSERT_TRUE(spool->remove_below(100).ok());
  EXPECT_LT(segments().size(), full);
  EXPECT_TRUE(spool->read(100).ok());
  EXPECT_TRUE(spool->read(199).ok());
  ASSERT_TRUE(spool->remove_below(200).ok());
  EXPECT_EQ(segments().size(), 1u);
  EXPECT_LE(spool->disk_bytes(), std::uint64_t{5} << 20);
  EXPECT_TRUE(spool->read(199).ok());
}

}  // namespace
}  // namespace relmap::publishing
