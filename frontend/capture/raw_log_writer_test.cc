#include "frontend/capture/raw_log_writer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "frontend/capture/testing/file_size_limit.h"
#include "frontend/capture/testing/raw_logs.h"

namespace relmap::capture {
namespace {

using namespace std::chrono_literals;
using testing_files::FileSizeLimit;
using testing_files::raw_bytes;
using testing_files::raw_frame;
using testing_files::raw_header;
using testing_files::read_all;
using testing_files::TemporaryFolder;
using testing_files::write_bytes;
using testing_files::write_raw_log;

template <typename Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 2000 && !condition(); ++i) std::this_thread::sleep_for(5ms);
  return condition();
}

// A disk that takes what the test wants it to: a pipe.
class SlowDisk {
 public:
  explicit SlowDisk(const std::string& path) {
    EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
    file_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    EXPECT_GE(file_, 0);
    EXPECT_GE(::fcntl(file_, F_SETPIPE_SZ, 65536), 65536);
  }
  ~SlowDisk() { ::close(file_); }
  // All that is there; true at the end of it.
  bool take(Bytes& into) {
    std::uint8_t some[65536];
    for (;;) {
      const ssize_t n = ::read(file_, some, sizeof some);
      if (n <= 0) return n == 0;
      into.insert(into.end(), some, some + n);
    }
  }

 private:
  int file_ = -1;
};

TEST(RawLogWriter, NeverWaitsForTheDiskNorTakesMoreMemoryAndSaysWhatItDropped) {
  TemporaryFolder folder;
  const std::string path = (folder.path() / "pipe").string();
  SlowDisk disk(path);
  const RawLogHeader header = raw_header();  // frames of 38,406 bytes
  RawLogOptions options;
  options.max_waiting = 5 * (38'406 + 200);
  auto opened = RawLogWriter::open(path, header, options);
  ASSERT_TRUE(opened.ok()) << opened.status().to_string();
  RawLogWriter& log = **opened;
  const auto add = [&](std::uint64_t i) { return log.add_frame(raw_frame(i), raw_bytes(header.layout, i)).reason(); };
  ASSERT_EQ(add(0), Reason::OK);  // the pipe has room for one
  ASSERT_TRUE(comes_true([&] { return log.counts().waiting == 0; }));
  for (std::uint64_t i = 1; i < 40; ++i) {
    ASSERT_EQ(add(i), i < 6 ? Reason::OK : Reason::DROPPED_BY_ROBOT) << i;
    ASSERT_LE(log.counts().waiting, options.max_waiting);
  }
  EXPECT_EQ(log.add_event({raw_frame(40).time_us, Reason::SHORT_FRAME, std::string(1000, 'x')}).reason(),
            Reason::DROPPED_BY_ROBOT);
  EXPECT_EQ(log.counts().dropped_frames, 34u);

  Bytes bytes;
  ASSERT_TRUE(comes_true([&] {
    disk.take(bytes);
    return log.counts().waiting == 0;
  }));
  ASSERT_EQ(add(40), Reason::OK);
  std::atomic<bool> closed = false;
  std::thread closing([&] {
    EXPECT_TRUE(log.close().ok());
    opened->reset();
    closed = true;
  });
  EXPECT_TRUE(comes_true([&] { return disk.take(bytes) && closed; }));
  closing.join();

  write_bytes(folder.path() / "log", bytes);
  auto reader = RawLogReader::open((folder.path() / "log").string());
  ASSERT_TRUE(reader.ok()) << reader.status().to_string();
  const auto whole = read_all(*reader);
  EXPECT_TRUE(whole.errors.empty());
  EXPECT_EQ(reader->torn_bytes(), 0u);
  EXPECT_EQ(whole.frames, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 40}));
  ASSERT_EQ(whole.events.size(), 1u);
  EXPECT_EQ(whole.events[0].reason, Reason::DROPPED_BY_ROBOT);
  EXPECT_EQ(whole.events[0].lost, 34u);
  EXPECT_EQ(whole.events[0].message, "34 frames dropped, and word of 1 fault: the disk did not keep up");
  EXPECT_EQ(whole.events[0].time_us, raw_frame(6).time_us);
}

TEST(RawLogWriter, SaysAtTheEndWhatItDropped) {
  TemporaryFolder folder;
  const RawLogHeader header = raw_header();
  RawLogOptions options;
  options.max_waiting = 1000;  // for no frame
  const std::string path = (folder.path() / "log").string();
  auto log = RawLogWriter::open(path, header, options);
  ASSERT_TRUE(log.ok());
  EXPECT_EQ((*log)->add_frame(raw_frame(0), raw_bytes(header.layout, 0)).reason(), Reason::DROPPED_BY_ROBOT);
  ASSERT_TRUE((*log)->close().ok());
  auto reader = RawLogReader::open(path);
  ASSERT_TRUE(reader.ok());
  const auto whole = read_all(*reader);
  ASSERT_EQ(whole.events.size(), 1u);
  EXPECT_EQ(whole.events[0].message, "1 frame dropped: the disk did not keep up");
}

TEST(RawLogWriter, NamesAFullDisk) {
  TemporaryFolder folder;
  const std::string path = (folder.path() / "full").string();
  std::filesystem::create_symlink("/dev/full", path);
  const auto log = RawLogWriter::open(path, raw_header());
  EXPECT_EQ(log.reason(), Reason::DISK_FULL) << log.status().to_string();
  EXPECT_NE(log.status().message().find(path), std::string::npos);
  EXPECT_EQ(RawLogWriter::open((folder.path() / "nowhere/log").string(), raw_header()).reason(), Reason::IO_ERROR);
}

TEST(RawLogWriter, IsWholeUpToWhereTheDiskFailed) {
  TemporaryFolder folder;
  const std::string path = (folder.path() / "log").string();
  const RawLogHeader header = raw_header();
  {
    const FileSizeLimit limit(100'000);
    auto log = RawLogWriter::open(path, header);
    ASSERT_TRUE(log.ok());
    for (std::uint64_t i = 0; i < 5; ++i) (void)(*log)->add_frame(raw_frame(i), raw_bytes(header.layout, i));
    ASSERT_TRUE(comes_true([&] { return (*log)->counts().dropped_frames >= 3; }));
    const Status refused = (*log)->add_event({1, Reason::CAMERA_GONE, "unplugged"});
    EXPECT_EQ(refused.reason(), Reason::IO_ERROR) << refused.to_string();
    EXPECT_NE(refused.message().find("File too large"), std::string::npos) << refused.to_string();
    EXPECT_EQ((*log)->counts().waiting, 0u);
    EXPECT_EQ((*log)->close().reason(), Reason::IO_ERROR);
    EXPECT_EQ((*log)->close().reason(), Reason::IO_ERROR);
  }
  auto reader = RawLogReader::open(path);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ(reader->torn_bytes(), 0u);
  EXPECT_EQ(read_all(*reader).frames, (std::vector<std::uint64_t>{0, 1}));
}

TEST(RawLogWriter, RefusesByName) {
  TemporaryFolder folder;
  const std::string path = (folder.path() / "log").string();
  RawLogHeader header = raw_header();
  write_raw_log(path, header, 1);
  const auto there = RawLogWriter::open(path, header);
  EXPECT_EQ(there.status().to_string(), "INVALID_ARGUMENT: " + path + " is there: it is not written over");
  header.layout.width = 0;
  EXPECT_EQ(RawLogWriter::open(path + "2", header).reason(), Reason::BAD_SIZE);
  header = raw_header();
  header.calibration->left.fx = -1;
  EXPECT_EQ(RawLogWriter::open(path + "2", header).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_FALSE(std::filesystem::exists(path + "2"));

  header = raw_header();
  auto log = RawLogWriter::open(path + "2", header);
  ASSERT_TRUE(log.ok());
  EXPECT_EQ(RawLogWriter::open(path + "2", header).reason(), Reason::INVALID_ARGUMENT);  // while it is written
  EXPECT_EQ((*log)->add_frame({}, Bytes(header.layout.bytes() - 1)).reason(), Reason::BAD_SIZE);
  EXPECT_EQ((*log)->add_frame({}, Bytes(kMaxFrameBytes + 1)).reason(), Reason::BAD_SIZE);
  EXPECT_EQ((*log)->add_event({0, Reason::OK, "nothing"}).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_TRUE((*log)->close().ok());
  EXPECT_EQ((*log)->add_frame({}, Bytes(header.layout.bytes())).reason(), Reason::WRONG_STATE);
  EXPECT_TRUE((*log)->close().ok());
}

TEST(RawLogWriter, IsReadWhileItIsWritten) {
  TemporaryFolder folder;
  const std::string path = (folder.path() / "log").string();
  const RawLogHeader header = raw_header();
  RawLogOptions options;
  options.sync_every = 1ms;
  auto log = RawLogWriter::open(path, header, options);
  ASSERT_TRUE(log.ok());
  std::thread writing([&] {
    for (std::uint64_t i = 0; i < 200; ++i) {
      EXPECT_TRUE((*log)->add_frame(raw_frame(i), raw_bytes(header.layout, i)).ok());
      if (i % 8 == 0) std::this_thread::sleep_for(1ms);
    }
    EXPECT_TRUE((*log)->close().ok());
  });
  std::size_t last = 0;
  for (int i = 0; i < 10; ++i) {
    auto reader = RawLogReader::open(path);
    ASSERT_TRUE(reader.ok()) << reader.status().to_string();
    const auto whole = read_all(*reader);
    EXPECT_TRUE(whole.errors.empty());
    EXPECT_GE(whole.frames.size(), last);
    last = whole.frames.size();
  }
  writing.join();
  auto reader = RawLogReader::open(path);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ(reader->frames(), 200u);
  EXPECT_EQ((*log)->counts().frames, 200u);
  EXPECT_EQ((*log)->counts().bytes, std::filesystem::file_size(path));
}

// Writes until it is killed, and says by the pipe how many bytes it has written.
[[noreturn]] void write_for_ever(const std::string& path, int pipe) {
  const RawLogHeader header = raw_header();
  auto log = RawLogWriter::open(path, header);
  if (!log.ok()) ::_exit(1);
  for (std::uint64_t i = 0;; ++i) {
    (void)(*log)->add_frame(raw_frame(i), raw_bytes(header.layout, i));
    const std::uint64_t bytes = (*log)->counts().bytes;
    if (::write(pipe, &bytes, sizeof bytes) != sizeof bytes) ::_exit(1);
    if (i > 100) std::this_thread::sleep_for(1ms);
  }
}

TEST(RawLogWriter, LosesNothingThatWasWrittenWhenItIsKilled) {
  for (int round = 0; round < 3; ++round) {
    TemporaryFolder folder;
    const std::string path = (folder.path() / "log").string();
    int pipe[2];
    ASSERT_EQ(::pipe(pipe), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) write_for_ever(path, pipe[1]);
    ::close(pipe[1]);
    std::uint64_t written = 0, said = 0;
    while (written < 2'000'000u + 311'111u * static_cast<unsigned>(round) &&
           ::read(pipe[0], &said, sizeof said) == sizeof said)
      written = said;
    ::kill(child, SIGKILL);
    while (::read(pipe[0], &said, sizeof said) == sizeof said) written = said;
    ::close(pipe[0]);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));

    auto reader = RawLogReader::open(path);
    ASSERT_TRUE(reader.ok()) << reader.status().to_string();
    EXPECT_GE(end_of(reader->index()), written);
    const auto whole = read_all(*reader);
    EXPECT_TRUE(whole.errors.empty());
    EXPECT_GT(whole.frames.size(), 50u);
    for (std::size_t i = 0; i < whole.frames.size(); ++i) ASSERT_EQ(whole.frames[i], i);
  }
}

}  // namespace
}  // namespace relmap::capture
