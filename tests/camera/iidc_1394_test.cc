// Cameras of the process that serves IEEE 1394. There is no such bus in a simulation: libdc1394 reaches them over USB.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "frontend/capture/dc1394/dc1394_bus.h"
#include "frontend/capture/iidc/live_camera.h"
#include "frontend/capture/iidc/registers.h"
#include "tests/camera/iidc_fixture.h"
#include "tests/paths.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kGuid = 0x00b0'9d01'00c0'ffee;

// Processes that this one started.
std::vector<pid_t> children() {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (!std::all_of(name.begin(), name.end(), [](char digit) { return digit >= '0' && digit <= '9'; })) continue;
    std::ifstream in(entry.path() / "stat");
    std::string stat;
    std::getline(in, stat);
    const std::size_t behind_name = stat.rfind(')');
    pid_t parent = 0;
    char state = 0;
    if (behind_name != std::string::npos &&
        std::sscanf(stat.c_str() + behind_name + 1, " %c %d", &state, &parent) == 2 && parent == ::getpid())
      found.push_back(std::stoi(name));
  }
  return found;
}

class Iidc1394Test : public IidcFixture {
 protected:
  ~Iidc1394Test() override { EXPECT_TRUE(children().empty()); }

  static std::shared_ptr<iidc::CameraBus> bus() {
    iidc::Dc1394Options options;
    options.program = RELMAP_BIN_DIR "/relmap-camera-1394";
    options.usb_too = true;
    return iidc::open_dc1394_bus(options).or_throw();
  }
  std::unique_ptr<iidc::LiveCamera> open_live(const iidc::LiveOptions& options = patient()) {
    auto live = iidc::LiveCamera::open({bus()}, options, stop_);
    EXPECT_TRUE(live.ok()) << live.status().to_string();
    return live.ok() ? std::move(*live) : nullptr;
  }
  static void expect_in_order(const Watched& seen) {
    EXPECT_EQ(0u, seen.torn);
    EXPECT_TRUE(std::is_sorted(seen.numbers.begin(), seen.numbers.end()));
  }
};

TEST_F(Iidc1394Test, CamerasAreListed) {
  plug();
  const auto there = bus();
  for (int i = 0; i < 2; ++i) {  // once asked, once known
    const auto cameras = there->cameras();
    ASSERT_TRUE(cameras.ok()) << cameras.status().to_string();
    ASSERT_EQ(1u, cameras->size());
    const iidc::CameraAddress& camera = cameras->front();
    EXPECT_TRUE(camera.usable.ok()) << camera.usable.to_string();
    EXPECT_EQ(kGuid, camera.guid);
    EXPECT_EQ("12345678", camera.serial);
    EXPECT_EQ("Point Grey Research", camera.vendor);
    EXPECT_EQ("Bumblebee2 BB2-03S2C-38", camera.model);
    EXPECT_EQ("1394", camera.bus);
    EXPECT_EQ(0u, camera.place.find("USB bus 1, device ")) << camera.place;
  }
  EXPECT_EQ(Reason::NO_CAMERA, there->open(1).reason());
}

TEST_F(Iidc1394Test, CamerasOnUsbAreLeftToTheirOwnDriver) {
  plug();
  const std::filesystem::path nodes = std::filesystem::path(testbed_.folder()) / "nodes";
  std::filesystem::create_directories(nodes / "fw1");
  std::ofstream(nodes / "fw1" / "guid") << "0x00b09d0100c0ffee\n";
  std::ofstream(nodes / "fw1" / "units") << "0x00a02d:0x000102\n";
  iidc::Dc1394Options options;
  options.program = RELMAP_BIN_DIR "/relmap-camera-1394";
  options.nodes = nodes;
  EXPECT_EQ("NO_CAMERA: libdc1394 finds no such camera",
            iidc::open_dc1394_bus(options).or_throw()->open(kGuid).status().to_string());
}

TEST_F(Iidc1394Test, RegistersAreReadAndWritten) {
  const auto camera = plug();
  const auto there = bus();
  auto link = there->open(kGuid);
  ASSERT_TRUE(link.ok()) << link.status().to_string();
  iidc::CameraAddress address;
  const auto rom = iidc::identify(**link, address);
  ASSERT_TRUE(rom) << address.usable.to_string();
  std::vector<std::uint32_t> quadlets(20);
  ASSERT_TRUE((*link)->read(iidc::kConfigRom, quadlets).ok());
  EXPECT_EQ(0x3133'3934u, quadlets[1]);
  const std::uint64_t mode = rom->command_registers + iidc::reg::kCurrentMode;
  ASSERT_TRUE((*link)->write(mode, 3u << 29).ok());
  ASSERT_TRUE((*link)->read(mode, {quadlets.data(), 1}).ok());
  EXPECT_EQ(3u << 29, quadlets[0]);
  EXPECT_EQ(3u << 29, camera->command_register(iidc::reg::kCurrentMode));
  const Status refused = (*link)->read(iidc::kRegisterSpace + 0x10, {quadlets.data(), 1});
  EXPECT_EQ(Reason::IO_ERROR, refused.reason()) << refused.to_string();
  EXPECT_NE(std::string::npos, refused.message().find("FFFFF0000010h")) << refused.message();
  testbed_.unplug(camera);
  EXPECT_EQ(Reason::CAMERA_GONE, (*link)->read(mode, {quadlets.data(), 1}).reason());
  EXPECT_EQ(Reason::NO_CAMERA, there->open(kGuid).reason());
}

TEST_F(Iidc1394Test, EveryFrameOfAFastStreamComesWhole) {
  const auto camera = plug();
  const auto live = open_live();
  ASSERT_TRUE(live);
  EXPECT_EQ("format7.3, 640 x 480 RAW16 at 48/s", live->format().describe());
  const auto start = std::chrono::steady_clock::now();
  Watched seen;
  watch(*live, seen, [&] { return seen.frames() == 144; });
  EXPECT_GT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 2.5) << "none comes twice";
  expect_in_order(seen);
  ASSERT_EQ(144u, seen.frames());
  EXPECT_EQ(143u, seen.numbers.back() - seen.numbers.front());
  EXPECT_TRUE(seen.gaps.empty());
  EXPECT_EQ(0u, live->counts().lost);
}

TEST_F(Iidc1394Test, FramesThatAreKeptStayAsTheyAre) {
  plug();
  const auto live = open_live();
  ASSERT_TRUE(live);
  std::vector<iidc::RawFrame> kept;
  while (kept.size() < 6) {
    const auto frame = live->next();
    if (frame.ok() && frame->has_value()) kept.push_back((*frame)->raw);
  }
  std::this_thread::sleep_for(milliseconds(500));
  for (std::size_t i = 0; i < kept.size(); ++i)
    EXPECT_TRUE(default_frame_number(kept[i].bytes().first(live->format().image_bytes))) << i;
}

TEST_F(Iidc1394Test, AShortFrameIsAGap) {
  const auto camera = plug();
  const auto live = open_live();
  ASSERT_TRUE(live);
  camera->fail([](CameraFaults& faults) { faults.short_frames = 3; });
  Watched seen;
  watch(*live, seen, [&] { return seen.frames() >= 30; });
  expect_in_order(seen);
  EXPECT_EQ(3u, seen.gaps[Reason::SHORT_FRAME]);
  EXPECT_EQ(3u, live->counts().lost);
}

TEST_F(Iidc1394Test, AProcessThatIsKilledIsReplaced) {
  plug();
  const auto live = open_live();
  ASSERT_TRUE(live);
  for (int round = 0; round < 3; ++round) {
    Watched before;
    watch(*live, before, [&] { return before.frames() >= 20; });
    expect_in_order(before);
    const auto processes = children();
    ASSERT_EQ(1u, processes.size());
    ::kill(processes[0], SIGKILL);
    const auto killed = std::chrono::steady_clock::now();
    Status gone;
    while (gone.ok()) {
      const auto frame = live->next();
      if (!frame.ok()) gone = frame.status();
    }
    EXPECT_EQ("CAMERA_GONE: the process that serves IEEE 1394 has ended (signal 9); waiting for it", gone.to_string());
    Watched after;
    watch(*live, after, [&] { return after.frames() >= 1; });
    std::printf("back after %.0f ms\n",
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - killed).count());
    expect_in_order(after);
    EXPECT_EQ(static_cast<std::uint64_t>(round + 1), live->counts().reopened);
  }
}

TEST_F(Iidc1394Test, AProcessThatHangsIsReplaced) {
  plug();
  const auto live = open_live();
  ASSERT_TRUE(live);
  Watched before;
  watch(*live, before, [&] { return before.frames() >= 20; });
  const auto processes = children();
  ASSERT_EQ(1u, processes.size());
  ::kill(processes[0], SIGSTOP);
  const auto stopped = std::chrono::steady_clock::now();
  Watched after;
  watch(*live, after, [&] { return live->counts().reopened == 1 && after.frames() >= 20; });
  std::printf("back after %.0f ms\n",
              std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - stopped).count());
  EXPECT_EQ(1u, after.gaps[Reason::CAMERA_GONE]);
  expect_in_order(after);
  EXPECT_TRUE(eventually([&] { return children().size() == 1; }));
}

TEST_F(Iidc1394Test, ACameraThatIsUnpluggedIsWaitedFor) {
  const auto camera = plug();
  const auto live = open_live();
  ASSERT_TRUE(live);
  for (int round = 0; round < 3; ++round) {
    Watched before;
    watch(*live, before, [&] { return before.frames() >= 20; });
    expect_in_order(before);
    ASSERT_TRUE(testbed_.unplug_in_mid_frame(camera));
    Watched gap;
    watch(*live, gap, [&] { return gap.gaps[Reason::CAMERA_GONE] > 0; });
    expect_in_order(gap);
    std::this_thread::sleep_for(milliseconds(200));
    testbed_.plug(camera);
    Watched after;
    watch(*live, after, [&] { return after.frames() >= 1; });
    EXPECT_EQ(static_cast<std::uint64_t>(round + 1), live->counts().reopened);
  }
}

TEST_F(Iidc1394Test, ACrashCostsOneCamera) {
  SimulatedCameraOptions other;
  other.guid = kGuid + 1;
  other.serial = 87654321;
  plug();
  plug(other);
  const auto there = bus();
  ASSERT_EQ(2u, there->cameras().or_throw().size());
  iidc::LiveOptions first = patient(), second = patient();
  first.serial = "12345678";
  second.serial = "87654321";
  auto one = iidc::LiveCamera::open({there}, first, stop_).or_throw();
  const auto first_process = children();
  ASSERT_EQ(1u, first_process.size());
  auto two = iidc::LiveCamera::open({there}, second, stop_).or_throw();
  Watched seen;
  watch(*two, seen, [&] { return seen.frames() >= 3; });
  ::kill(first_process[0], SIGKILL);
  watch(*two, seen, [&] { return seen.frames() >= 10; });
  expect_in_order(seen);
  EXPECT_TRUE(seen.gaps.empty());
  EXPECT_EQ(0u, two->counts().lost);
}

TEST_F(Iidc1394Test, TheCameraProcessIgnoresSignalsToEnd) {
  plug();
  const auto live = open_live();
  ASSERT_TRUE(live);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::kill(children().at(0), number);
  Watched seen;
  watch(*live, seen, [&] { return seen.frames() >= 30; });
  EXPECT_TRUE(seen.gaps.empty());
}

// As if the front-end had crashed: nothing of it is left but what the process sees of its socket.
TEST_F(Iidc1394Test, ACameraIsStoppedWhenItsProgramEnds) {
  const auto camera = plug();
  {
    const auto there = bus();
    const auto link = there->open(kGuid).or_throw();
    const iidc::RegisterFile registers(*link, iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters);
    const auto format = iidc::set_stream(registers, {}).or_throw();
    const Status started = link->start({format.frame_bytes, format.image_bytes, 4});
    ASSERT_TRUE(started.ok()) << started.to_string();
    ASSERT_TRUE(iidc::set_sending(registers, true).ok());
    EXPECT_EQ(iidc::kOn, camera->command_register(iidc::reg::kIsoEnable));
  }
  EXPECT_TRUE(eventually([&] { return camera->command_register(iidc::reg::kIsoEnable) == 0; }));
}

}  // namespace
}  // namespace relmap::testing
