#include <gtest/gtest.h>

#include "frontend/capture/stereo_source.h"
#include "frontend/capture/testing/raw_logs.h"

namespace relmap::capture {
namespace {

using testing_files::raw_bytes;
using testing_files::raw_frame;
using testing_files::raw_header;
using testing_files::read_bytes;
using testing_files::TemporaryFolder;
using testing_files::write_bytes;
using testing_files::write_raw_log;
using testing_files::write_text;

class RawLogSource : public testing::Test {
 protected:
  std::string write(const RawLogHeader& header, std::uint64_t frames = 5) {
    write_raw_log(path_, header, frames, 3);
    return path_;
  }
  TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "drive.raw").string();
};

TEST_F(RawLogSource, ReplaysWhatTheCameraSent) {
  const RawLogHeader header = raw_header();
  const auto opened = open_source("auto", write(header));
  ASSERT_TRUE(opened.ok()) << opened.status().to_string();
  StereoSource& source = **opened;
  EXPECT_EQ(source.count(), 5u);
  EXPECT_EQ(source.skipped(), 0u);
  EXPECT_EQ(source.expected(), 8u) << "3 frames were lost";
  EXPECT_EQ(source.missing().count, 3u);
  ASSERT_EQ(source.missing().first.size(), 1u);
  EXPECT_TRUE(source.missing().first[0].starts_with("frames at byte ")) << source.missing().first[0];
  EXPECT_TRUE(source.imu().empty());
  EXPECT_TRUE(source.stamps_rise());
  EXPECT_EQ(source.describe(), "raw log " + path_ +
                                   ": 5 pairs of 160 x 120 by Point Grey Research Bumblebee2 BB2-08S2C 7060123, to be "
                                   "rectified; 1 fault, 3 frames lost by them");
  EXPECT_TRUE(source.fingerprint().starts_with("raw frames from 1500000000000000 us on, the first of checksum "));
  EXPECT_EQ(source.calibration().left, header.calibration->left);
  EXPECT_EQ(source.calibration().T_right_left.R, header.calibration->T_right_left.R);
  EXPECT_EQ(source.rectifier().camera().width, 160);

  for (std::uint64_t i = 0; i < 5; ++i) {
    auto pair = source.next();
    if (i == 3) {
      EXPECT_EQ(pair.status().to_string(), "CAMERA_STALLED: " + path_ + ": endpoint 2 halted (3 frames lost)");
      pair = source.next();
    }
    ASSERT_TRUE(pair.ok() && *pair);
    EXPECT_EQ((*pair)->index, i);
    EXPECT_EQ((*pair)->time_us, raw_frame(i).time_us);
    EXPECT_EQ((*pair)->picture, "frame " + std::to_string(i));
    vision::Image left, right;
    ASSERT_TRUE(unpack(header.layout, raw_bytes(header.layout, i), left, right).ok());
    EXPECT_TRUE(vision::same_picture((*pair)->left, left));
    EXPECT_TRUE(vision::same_picture((*pair)->right, right));
    EXPECT_FALSE(vision::same_picture(left, right));
  }
  EXPECT_FALSE(*source.next());
}

TEST_F(RawLogSource, SkipsToWhereARunContinues) {
  const auto opened = open_raw_log(write(raw_header()));
  ASSERT_TRUE(opened.ok());
  (*opened)->skip_before(raw_frame(4).time_us);
  const auto pair = (*opened)->next();
  ASSERT_TRUE(pair.ok() && *pair);
  EXPECT_EQ((*pair)->index, 4u);
}

TEST_F(RawLogSource, TellsRecordingsApart) {
  const auto one = open_raw_log(write(raw_header()));
  const std::string other_path = path_ + "2";
  auto log = RawLogWriter::open(other_path, raw_header());
  ASSERT_TRUE(log.ok());
  RawLogFrame frame = raw_frame(1);
  ASSERT_TRUE((*log)->add_frame(frame, raw_bytes(raw_header().layout, 1)).ok());
  frame.time_us -= 1;
  ASSERT_TRUE((*log)->add_frame(frame, raw_bytes(raw_header().layout, 1)).ok());
  ASSERT_TRUE((*log)->close().ok());
  const auto other = open_raw_log(other_path);
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_NE((*one)->fingerprint(), (*other)->fingerprint());
  EXPECT_FALSE((*other)->stamps_rise());
  EXPECT_EQ((*one)->fingerprint(), (*open_raw_log(path_))->fingerprint());
}

TEST_F(RawLogSource, GapsInTheNumbersOfFramesAreMissingFrames) {
  auto log = RawLogWriter::open(path_, raw_header());
  ASSERT_TRUE(log.ok());
  for (const std::uint64_t index : {0, 1, 5, 6})
    ASSERT_TRUE((*log)->add_frame(raw_frame(index), raw_bytes(raw_header().layout, index)).ok());
  ASSERT_TRUE((*log)->close().ok());
  const auto source = open_raw_log(path_);
  ASSERT_TRUE(source.ok());
  EXPECT_EQ((*source)->count(), 4u);
  EXPECT_EQ((*source)->expected(), 7u);
  EXPECT_EQ((*source)->missing().count, 3u);
}

TEST_F(RawLogSource, TakesAnotherCalibration) {
  RawLogHeader header = raw_header();
  header.calibration.reset();
  write(header);
  EXPECT_EQ(open_raw_log(path_).reason(), Reason::NO_CALIBRATION);
  FolderOptions options;
  options.calibration = (folder_.path() / "calib.txt").string();
  EXPECT_EQ(open_raw_log(path_, options).reason(), Reason::NO_SUCH_FILE);
  write_text(options.calibration, testing_files::kKittiCalibration);
  const auto opened = open_source("raw", path_, options);
  ASSERT_TRUE(opened.ok()) << opened.status().to_string();
  EXPECT_TRUE((*opened)->rectifier().passes_through());
  EXPECT_EQ((*opened)->calibration().width, 160);
  write_text(options.calibration, "P0: 100 0 79.5 0 0 100 59.5 0 0 0 1 0\n");
  EXPECT_EQ(open_raw_log(path_, options).reason(), Reason::NOT_STEREO);
}

TEST_F(RawLogSource, SaysWhatIsDamagedAndGoesOn) {
  write(raw_header());
  auto index = parse_raw_log_index(read_bytes(path_ + ".idx"));
  Bytes bytes = read_bytes(path_);
  const std::uint64_t second = index[3].offset, last = index.back().offset;
  bytes[second + 5000] ^= 1;   // its pixels
  bytes[second + 40000] ^= 1;  // the next one's head
  bytes.resize(static_cast<std::size_t>(last) + 777);
  write_bytes(path_, bytes);
  std::filesystem::remove(path_ + ".idx");
  const auto opened = open_source("auto", path_);
  ASSERT_TRUE(opened.ok()) << opened.status().to_string();
  EXPECT_EQ((*opened)->count(), 4u);
  EXPECT_NE((*opened)->describe().find("; torn: the last 777 bytes are no whole record"), std::string::npos)
      << (*opened)->describe();
  EXPECT_TRUE(*(*opened)->next());
  const auto damaged = (*opened)->next();
  EXPECT_EQ(damaged.status().to_string(),
            "CORRUPT: " + path_ + ", byte " + std::to_string(second) + ": frame 1 is damaged");
}

TEST_F(RawLogSource, RefusesByName) {
  write_text(path_, "a text of some length");
  EXPECT_EQ(open_source("raw", path_).reason(), Reason::CORRUPT);
  EXPECT_EQ(open_source("auto", path_).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(open_source("raw", path_ + "x").reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(open_source("raw", folder_.path().string()).status().reason(), Reason::IO_ERROR);
  std::filesystem::remove(path_);
  write(raw_header(), 0);
  const auto empty = open_raw_log(path_);
  EXPECT_EQ(empty.status().to_string(), "NO_SUCH_FILE: " + path_ + " holds no frame");
}

}  // namespace
}  // namespace relmap::capture
