// The bus with programs that are not what they should be.
#include "frontend/capture/dc1394/dc1394_bus.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

namespace relmap::iidc {
namespace {

namespace fs = std::filesystem;

class Iidc1394Bus : public ::testing::Test {
 protected:
  Iidc1394Bus() {
    fs::create_directories(folder_ / "nodes" / "fw0");
    fs::create_directories(folder_ / "nodes" / "fw1");
    options_.nodes = folder_ / "nodes";
    options_.program = folder_ / "program";
    std::ofstream(folder_ / "nodes" / "fw1" / "guid") << "0x00b09d0100c0ffee\n";
    std::ofstream(folder_ / "nodes" / "fw1" / "units") << "0x00a02d:0x000102\n";
    std::ofstream(folder_ / "nodes" / "fw1" / "model_name") << "Bumblebee2\n";
  }
  ~Iidc1394Bus() override {
    fs::remove_all(folder_);
    EXPECT_EQ(-1, ::waitpid(-1, nullptr, WNOHANG));  // no child is left, not even a dead one
    EXPECT_EQ(ECHILD, errno);
  }

  // A program that runs these commands.
  std::shared_ptr<CameraBus> with_program(const std::string& commands) {
    std::ofstream(options_.program) << "#!/bin/sh\n" << commands << '\n';
    fs::permissions(options_.program, fs::perms::owner_all);
    return open_dc1394_bus(options_).or_throw();
  }

  static std::size_t open_files() {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()));
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("bus1394-" + std::to_string(::getpid()));
  Dc1394Options options_;
  static constexpr std::uint64_t kGuid = 0x00b0'9d01'00c0'ffee;
};

TEST_F(Iidc1394Bus, AMissingProgramIsNamed) {
  EXPECT_EQ("UNSUPPORTED: IEEE 1394 is served by " + options_.program + ", which is not installed",
            open_dc1394_bus(options_).status().to_string());
  options_.program.clear();
  ::setenv("RELMAP_CAMERA_1394", "/nowhere/camera", 1);
  EXPECT_EQ("UNSUPPORTED: IEEE 1394 is served by /nowhere/camera, which is not installed",
            open_dc1394_bus(options_).status().to_string());
  ::unsetenv("RELMAP_CAMERA_1394");
  EXPECT_NE(std::string::npos, open_dc1394_bus(options_).status().message().find("/relmap-camera-1394, which is not"));
}

TEST_F(Iidc1394Bus, WithoutABusNoProcessIsStarted) {
  options_.nodes = folder_ / "nowhere";
  const auto bus = with_program("touch " + (folder_ / "started").string());
  EXPECT_EQ("1394", bus->name());
  EXPECT_EQ(Reason::UNSUPPORTED, bus->cameras().reason());
  EXPECT_EQ(Reason::UNSUPPORTED, bus->open(kGuid).reason());
  options_.nodes = folder_ / "nodes";
  EXPECT_EQ(Reason::NO_CAMERA, with_program("touch " + (folder_ / "started").string())->open(1).reason());
  EXPECT_FALSE(fs::exists(folder_ / "started"));
}

TEST_F(Iidc1394Bus, ACrashIsReported) {
  const auto bus = with_program("kill -SEGV $$");
  const auto cameras = bus->cameras();
  ASSERT_TRUE(cameras.ok()) << cameras.status().to_string();
  ASSERT_EQ(1u, cameras->size());
  const CameraAddress& camera = cameras->front();
  EXPECT_EQ(kGuid, camera.guid);
  EXPECT_EQ("00b09d0100c0ffee", camera.serial);
  EXPECT_EQ("Bumblebee2", camera.model);
  EXPECT_EQ("1394", camera.bus);
  EXPECT_EQ("/dev/fw1", camera.place);
  EXPECT_EQ("CAMERA_GONE: the process that serves IEEE 1394 has ended (signal 11)", camera.usable.to_string());
}

TEST_F(Iidc1394Bus, AProcessThatCrashesIsNotStartedAgainAtOnce) {
  const fs::path starts = folder_ / "starts";
  const auto bus = with_program("echo >> " + starts.string() + "\nexit 3");
  const auto begin = std::chrono::steady_clock::now();
  const auto started = [&] { return fs::exists(starts) ? fs::file_size(starts) : 0; };
  while (started() < 4 && std::chrono::steady_clock::now() - begin < std::chrono::seconds(60)) {
    const auto link = bus->open(kGuid);
    EXPECT_EQ("CAMERA_GONE: the process that serves IEEE 1394 has ended (exit status 3)", link.status().to_string());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  // At 0, 100, 300 and 700 ms, or later.
  EXPECT_EQ(started(), 4u);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(700));
}

TEST_F(Iidc1394Bus, AnInvalidProgramLeavesNoFilesOpen) {
  const auto bus = with_program("exit 0");
  (void)bus->open(kGuid);
  const std::size_t before = open_files();
  for (int i = 0; i < 5; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    (void)bus->open(kGuid);
  }
  EXPECT_EQ(before, open_files());
  std::ofstream(options_.program) << "\x7f"
                                     "ELF, but no more";
  EXPECT_EQ(Reason::UNSUPPORTED, open_dc1394_bus(options_).or_throw()->open(kGuid).reason());
}

// It gets the socket, and nothing else that this process has open.
TEST_F(Iidc1394Bus, TheProcessInheritsOneFile) {
  const int leaky = ::open("/dev/null", O_RDONLY);
  const fs::path files = folder_ / "files";
  const auto bus = with_program("ls /proc/$$/fd > " + files.string());
  (void)bus->open(kGuid);
  ::close(leaky);
  std::ifstream in(files);
  std::string all, line;
  while (std::getline(in, line))
    if (line.size() == 1) all += line;  // the shell reads its script by a file above 9
  EXPECT_EQ("0123", all);
}

TEST_F(Iidc1394Bus, ASilentProgramIsKilled) {
  const auto bus = with_program("exec sleep 1000");
  EXPECT_EQ("CAMERA_GONE: the process that serves IEEE 1394 has ended (it did not answer within 5 s and was killed)",
            bus->open(kGuid).status().to_string());
}

}  // namespace
}  // namespace relmap::iidc
