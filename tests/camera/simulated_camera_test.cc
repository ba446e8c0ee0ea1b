#include "tests/camera/simulated_camera.h"

#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <thread>
#include <vector>

#include "frontend/capture/iidc/registers.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
namespace reg = iidc::reg;
namespace format7 = iidc::format7;
namespace control = iidc::control;
using Answer = SimulatedCamera::Answer;

constexpr std::uint32_t kShutter = 4 * 7, kTrigger = 4 * 12, kFrameRate = 4 * 15;

class SimulatedCameraTest : public ::testing::Test {
 protected:
  static constexpr std::uint64_t kBase = iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters;

  std::uint32_t read(std::uint32_t offset) { return camera.command_register(offset); }
  std::uint32_t write(std::uint32_t offset, std::uint32_t quadlet) {
    EXPECT_EQ(Answer::kDone, camera.write(kBase + offset, quadlet));
    return read(offset);
  }
  // Of a Format7 mode's registers, from the command registers on.
  std::uint32_t csr(std::uint32_t mode) {
    return 4 * read(reg::kFormat7CsrInq + 4 * mode) - SimulatedCamera::kCommandRegisters;
  }
  std::uint32_t absolute_csr(std::uint32_t feature) {
    return 4 * read(reg::kAbsoluteCsrInq + feature) - SimulatedCamera::kCommandRegisters;
  }
  void select_stereo() {
    write(reg::kCurrentFormat, 7u << 29);
    write(reg::kCurrentMode, 3u << 29);
  }
  // Nothing within 200 ms: nullopt.
  std::optional<SimulatedCamera::Frame> next() {
    const auto due = camera.next_start();
    if (!due || *due > SimulatedCamera::Clock::now() + milliseconds(200)) return std::nullopt;
    std::this_thread::sleep_until(*due);
    return camera.take_frame(SimulatedCamera::Clock::now());
  }
  static std::uint32_t big_endian(const SimulatedCamera::Frame& frame, std::size_t place) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | frame.bytes.at(place + i);
    return value;
  }

  SimulatedCamera camera;
};

std::uint32_t rom_crc(const std::vector<std::uint32_t>& quadlets) {  // as IEEE 1212 prints it, by nibbles
  std::uint32_t crc = 0;
  for (const std::uint32_t quadlet : quadlets)
    for (int shift = 28; shift >= 0; shift -= 4) {
      const std::uint32_t sum = (crc >> 12 ^ quadlet >> shift) & 15;
      crc = crc << 4 ^ sum << 12 ^ sum << 5 ^ sum;
    }
  return crc & 0xffff;
}

TEST_F(SimulatedCameraTest, ItsRomIsValidUnlessAFaultIsSet) {
  const auto whole = [&] {
    std::vector<std::uint32_t> rom;
    std::uint32_t quadlet = 0;
    for (std::uint64_t at = iidc::kConfigRom; camera.read(at, quadlet) == Answer::kDone; at += 4)
      rom.push_back(quadlet);
    const std::uint32_t header = rom.front();
    rom.erase(rom.begin());
    EXPECT_EQ(rom.size(), header >> 16 & 0xff);
    EXPECT_EQ(0x31333934u, rom.front());
    return (header & 0xffff) == rom_crc(rom);
  };
  EXPECT_TRUE(whole());
  camera.fail([](CameraFaults& faults) { faults.bad_rom = true; });
  EXPECT_FALSE(whole());
}

TEST_F(SimulatedCameraTest, RefusesAddressesThatItDoesNotHave) {
  std::uint32_t quadlet = 0;
  for (const std::uint64_t address : {std::uint64_t{0}, iidc::kConfigRom + 0x3fc, kBase + 0xffc, kBase + 2})
    EXPECT_EQ(Answer::kRefused, camera.read(address, quadlet)) << std::hex << address;
  EXPECT_EQ(Answer::kRefused, camera.write(kBase + 0xffc, 1));
}

TEST_F(SimulatedCameraTest, KeepsOnlyWhatARegisterCanHold) {
  EXPECT_EQ(read(reg::kFormatInq), write(reg::kFormatInq, 0xffff'ffff));
  EXPECT_EQ(7u << 29, write(reg::kCurrentMode, 0xffff'ffff));
  const std::uint32_t brightness = write(reg::kFeature, 0xfff);
  EXPECT_EQ(255u, brightness & control::kValue);
  EXPECT_EQ(control::kPresent | control::kOn, brightness & ~control::kValue);
}

TEST_F(SimulatedCameraTest, AFeatureInAutomaticDoesNotTakeAValue) {
  const std::uint32_t before = read(reg::kFeature + kShutter);
  EXPECT_TRUE(before & control::kAuto);
  EXPECT_EQ(before, write(reg::kFeature + kShutter, control::kAuto | 17));
  EXPECT_EQ(17u, write(reg::kFeature + kShutter, 17) & (control::kAuto | control::kValue));
}

TEST_F(SimulatedCameraTest, AnAbsoluteValueIsClippedAndTakenInSteps) {
  const std::uint32_t place = absolute_csr(kShutter);
  const std::uint32_t before = read(place + iidc::absolute::kValue);
  EXPECT_EQ(before, write(place + iidc::absolute::kValue, std::bit_cast<std::uint32_t>(0.01f)));  // not told to
  write(reg::kFeature + kShutter, control::kAbsolute);
  const auto set = std::bit_cast<float>(write(place + iidc::absolute::kValue, std::bit_cast<std::uint32_t>(0.01f)));
  EXPECT_NE(0.01f, set);
  EXPECT_NEAR(0.01f, set, 4e-5f);
  const auto max = std::bit_cast<float>(write(place + iidc::absolute::kValue, std::bit_cast<std::uint32_t>(99.f)));
  EXPECT_EQ(std::bit_cast<float>(read(place + iidc::absolute::kMax)), max);
  EXPECT_EQ(1000u, read(reg::kFeature + kShutter) & control::kValue);
}

TEST_F(SimulatedCameraTest, Format7IsSetByHandshake) {
  select_stereo();
  const std::uint32_t at = csr(3);
  write(at + format7::kSize, 512u << 16 | 384);
  EXPECT_EQ(640u * 480, read(at + format7::kPixelNumber));  // not yet
  EXPECT_EQ(0u, write(reg::kIsoEnable, iidc::kOn));
  EXPECT_EQ(format7::setting::kPresent, write(at + format7::kValueSetting, format7::setting::kSetting1));
  EXPECT_EQ(512u * 384, read(at + format7::kPixelNumber));
  EXPECT_EQ(512u * 384 * 2, read(at + format7::kTotalBytesLo));
  const std::uint32_t packet = read(at + format7::kBytesPerPacket) & 0xffff;
  EXPECT_EQ(packet, write(at + format7::kBytesPerPacket, packet << 16) >> 16);
  EXPECT_EQ((512u * 384 * 2 + packet - 1) / packet, read(at + format7::kPacketsPerFrame));
  EXPECT_EQ(iidc::kOn, write(reg::kIsoEnable, iidc::kOn));
  const auto frame = next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(std::size_t{packet} * read(at + format7::kPacketsPerFrame), frame->bytes.size());

  write(at + format7::kBytesPerPacket, 4100u << 16);
  EXPECT_TRUE(read(at + format7::kValueSetting) & format7::setting::kError2);
  write(at + format7::kSize, 648u << 16 | 480);
  EXPECT_TRUE(write(at + format7::kValueSetting, format7::setting::kSetting1) & format7::setting::kError1);
}

TEST_F(SimulatedCameraTest, FormatsThatItDoesNotHaveAreAnError) {
  write(reg::kCurrentFormat, 1u << 29);
  EXPECT_EQ(iidc::kOn, read(0x628));
  EXPECT_EQ(0u, write(reg::kIsoEnable, iidc::kOn));
  EXPECT_FALSE(camera.next_start());
}

TEST_F(SimulatedCameraTest, FramesKeepToTheRateAskedFor) {
  select_stereo();
  write(reg::kFeature + kFrameRate, control::kOn | control::kAbsolute);
  write(absolute_csr(kFrameRate) + iidc::absolute::kValue, std::bit_cast<std::uint32_t>(20.f));
  write(reg::kIsoEnable, iidc::kOn);
  const auto first = next(), second = next();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->number + 1, second->number);
  EXPECT_NEAR(0.05, std::chrono::duration<double>(second->start - first->start).count(), 1e-3);
  EXPECT_LE(first->end, second->start);
}

TEST_F(SimulatedCameraTest, OneShotIsOneFrame) {
  select_stereo();
  EXPECT_EQ(iidc::kOn, write(reg::kOneShot, iidc::kOn));
  EXPECT_TRUE(next());
  EXPECT_EQ(0u, read(reg::kOneShot));
  EXPECT_FALSE(next());
}

TEST_F(SimulatedCameraTest, ATriggerIsWaitedFor) {
  select_stereo();
  write(reg::kFeature + kTrigger, control::kOn | 7u << control::kSourceShift);
  write(reg::kIsoEnable, iidc::kOn);
  EXPECT_FALSE(next());
  write(reg::kSoftwareTrigger, iidc::kOn);
  EXPECT_TRUE(next());
  EXPECT_EQ(0u, read(reg::kSoftwareTrigger));
  EXPECT_FALSE(next());
  write(reg::kFeature + kTrigger, control::kOn);
  camera.trigger();
  EXPECT_TRUE(next());
  EXPECT_FALSE(next());
  const std::uint32_t state = read(reg::kFeature + kTrigger);
  EXPECT_EQ(state, write(reg::kFeature + kTrigger, control::kOn | 3u << control::kSourceShift));  // no such source
}

TEST_F(SimulatedCameraTest, SendsNothingWithoutPowerOrAfterInitialisation) {
  select_stereo();
  write(reg::kIsoEnable, iidc::kOn);
  write(reg::kCameraPower, 0);
  EXPECT_EQ(0u, write(reg::kIsoEnable, iidc::kOn));
  write(reg::kCameraPower, iidc::kOn);
  EXPECT_EQ(iidc::kOn, write(reg::kIsoEnable, iidc::kOn));
  EXPECT_EQ(0u, write(reg::kInitialize, iidc::kOn));
  EXPECT_EQ(0u, read(reg::kIsoEnable));
  EXPECT_EQ(0u, read(reg::kCurrentFormat));
}

TEST_F(SimulatedCameraTest, EmbedsStampAndCounter) {
  select_stereo();
  write(iidc::pgr::kFrameInfo, iidc::pgr::kStamp | iidc::pgr::kFrameCounter);
  write(reg::kIsoEnable, iidc::kOn);
  ASSERT_TRUE(next());
  const auto frame = next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(camera.cycle_time(frame->start), big_endian(*frame, 0));
  EXPECT_EQ(frame->number, big_endian(*frame, 4));
  EXPECT_EQ(1u, default_frame_number(std::span(frame->bytes).first(kDefaultFrameBytes)));
}

TEST(SimulatedCamera, ItsClockDrifts) {
  SimulatedCameraOptions fast;
  fast.clock_drift_ppm = 100;
  const SimulatedCamera camera(fast);
  const auto seconds = [](std::uint32_t time) {
    return (time >> 25) + ((time >> 12 & 0x1fff) + (time & 0xfff) / 3072.0) / 8000;
  };
  const auto now = SimulatedCamera::Clock::now();
  const double passed = seconds(camera.cycle_time(now + std::chrono::seconds(100))) - seconds(camera.cycle_time(now));
  EXPECT_NEAR(100.01, passed, 1e-6);
}

TEST_F(SimulatedCameraTest, HasTheFaultsThatAreSet) {
  select_stereo();
  write(reg::kIsoEnable, iidc::kOn);
  const auto content = [](const SimulatedCamera::Frame& frame) {
    return std::span(frame.bytes).first(kDefaultFrameBytes);
  };
  camera.fail([](CameraFaults& faults) { faults.torn_frames = 1; });
  auto frame = next();
  ASSERT_TRUE(frame);
  EXPECT_FALSE(default_frame_number(content(*frame)));
  frame = next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(1u, default_frame_number(content(*frame)));

  camera.fail([](CameraFaults& faults) { faults.dead_eye = capture::FirstByte::kRight; });
  frame = next();
  ASSERT_TRUE(frame);
  for (std::size_t i = 0; i < 1000; i += 2) ASSERT_EQ(0, frame->bytes[i]);
  camera.fail([](CameraFaults& faults) { faults.dead_eye.reset(); });

  const std::uint64_t gain = kBase + reg::kFeature + 4 * 8;
  camera.fail([&](CameraFaults& faults) { faults.forgetful_registers = {gain}; });
  const std::uint32_t before = read(reg::kFeature + 4 * 8);
  EXPECT_EQ(before, write(reg::kFeature + 4 * 8, 100));
  camera.fail([&](CameraFaults& faults) { faults.mute_registers = {gain}; });
  std::uint32_t quadlet = 0;
  EXPECT_EQ(Answer::kNone, camera.read(gain, quadlet));
}

TEST(SimulatedCamera, SendsWhatItIsGiven) {
  SimulatedCameraOptions options;
  options.width = 512;
  options.height = 384;
  options.content = [](std::uint64_t number, std::span<std::uint8_t> bytes) {
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i % 2 == 0 ? 7 : number);
  };
  SimulatedCamera camera(options);
  const std::uint64_t base = iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters;
  camera.write(base + reg::kCurrentFormat, 7u << 29);
  camera.write(base + reg::kIsoEnable, iidc::kOn);  // mode 5 of that format is none
  EXPECT_FALSE(camera.next_start());
  for (const std::uint32_t mode : {0u, 3u}) {
    camera.write(base + reg::kCurrentMode, mode << 29);
    camera.write(base + reg::kOneShot, iidc::kOn);
    std::this_thread::sleep_until(camera.next_start().value());
    const auto frame = camera.take_frame(SimulatedCamera::Clock::now());
    ASSERT_TRUE(frame);
    EXPECT_GE(frame->bytes.size(), std::size_t{512} * 384 * (mode == 0 ? 1 : 2));
    EXPECT_EQ(7, frame->bytes[0]);
    EXPECT_EQ(mode == 0 ? 7 : 1, frame->bytes[1]);
  }
}

}  // namespace
}  // namespace relmap::testing
