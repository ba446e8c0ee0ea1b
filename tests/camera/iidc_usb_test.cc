// Our driver on unmodified libusb with a simulated camera: discovery, settings, streams, and its reaction to every
// fault.
#include <dirent.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <thread>

#include "frontend/capture/iidc/features.h"
#include "frontend/capture/iidc/iidc_source.h"
#include "frontend/capture/iidc/register_file.h"
#include "frontend/capture/iidc/registers.h"
#include "frontend/capture/iidc/video_mode.h"
#include "storage/testing/temporary_folder.h"
#include "tests/camera/iidc_fixture.h"

namespace relmap::testing {
namespace {

using namespace std::chrono_literals;
using iidc::Feature;
using iidc::FeatureSetting;
using iidc::LiveOptions;
using iidc::RegisterFile;

std::vector<std::string> entries(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) names.push_back(entry.path());
  return names;
}
std::size_t threads() { return entries("/proc/self/task").size(); }

// Open files: of the devices on the simulated bus (their simulation keeps one of each that ever was), and others.
struct Files {
  std::size_t devices = 0, others = 0;
};
Files files() {
  Files count;
  for (const std::string& file : entries("/proc/self/fd")) {
    std::error_code error;
    const bool device = std::filesystem::read_symlink(file, error).string().find("/dev/bus/usb/") != std::string::npos;
    ++(device ? count.devices : count.others);
  }
  return count;
}

class IidcUsb : public IidcFixture {
 protected:
  RegisterFile registers(iidc::CameraLink& link) {
    return RegisterFile(link, iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters);
  }
  std::unique_ptr<iidc::CameraLink> link() {
    auto opened = buses().front()->open(SimulatedCameraOptions{}.guid);
    EXPECT_TRUE(opened.ok()) << opened.status().to_string();
    return opened.ok() ? std::move(*opened) : nullptr;
  }
};

TEST_F(IidcUsb, FindsCamerasByTheirRom) {
  SimulatedCameraOptions other;
  other.guid += 1;
  other.serial = 777;
  plug();
  plug(other);
  const auto found = iidc::find_cameras(buses());
  ASSERT_EQ(found.size(), 2u);
  std::map<std::string, std::string> models;
  for (const auto& camera : found) {
    EXPECT_TRUE(camera.address.usable.ok()) << camera.address.usable.to_string();
    models[camera.address.serial] = camera.address.vendor + ", " + camera.address.model;
  }
  const std::string model = "Point Grey Research, Bumblebee2 BB2-03S2C-38";
  EXPECT_EQ(models, (std::map<std::string, std::string>{{"12345678", model}, {"777", model}}));

  EXPECT_EQ(iidc::choose_camera(buses(), "").reason(), Reason::INVALID_ARGUMENT);  // which of the two?
  EXPECT_EQ(iidc::choose_camera(buses(), "777")->address.guid, other.guid);
  EXPECT_EQ(iidc::choose_camera(buses(), iidc::guid_text(other.guid))->address.serial, "777");
  const auto none = iidc::choose_camera(buses(), "778");
  EXPECT_EQ(none.reason(), Reason::NO_CAMERA);
  EXPECT_NE(none.status().message().find("12345678"), std::string::npos) << none.status().message();
}

TEST_F(IidcUsb, AMissingCameraIsReportedByName) {
  EXPECT_TRUE(iidc::find_cameras(buses()).empty());
  EXPECT_EQ(iidc::LiveCamera::open(buses(), {}, stop_).reason(), Reason::NO_CAMERA);
}

TEST_F(IidcUsb, MissingPermissionIsReportedWithARemedy) {
  plug({}, UsbTestbed::Access::kNobody);
  const auto opened = iidc::LiveCamera::open(buses(), {}, stop_);
  EXPECT_EQ(opened.reason(), Reason::CAMERA_FORBIDDEN);
  EXPECT_NE(opened.status().message().find("udev"), std::string::npos) << opened.status().message();
}

TEST_F(IidcUsb, ReadsWhatTheCameraCan) {
  plug();
  const auto camera = link();
  ASSERT_TRUE(camera);
  const auto modes = iidc::read_modes(registers(*camera));
  ASSERT_TRUE(modes.ok()) << modes.status().to_string();
  std::map<std::string, const iidc::ModeInfo*> by_name;
  for (const auto& mode : *modes) by_name[mode.mode.name()] = &mode;
  for (const char* name : {"format0.5", "format0.6", "format2.2", "format2.6", "format7.0", "format7.3"})
    ASSERT_TRUE(by_name.contains(name)) << name;
  EXPECT_EQ(by_name["format2.6"]->width, 1280);
  EXPECT_FALSE(by_name["format0.6"]->rates_hz.empty());
  EXPECT_EQ(by_name["format7.3"]->width, 640);

  const auto features = iidc::read_features(registers(*camera));
  ASSERT_TRUE(features.ok()) << features.status().to_string();
  std::map<Feature, iidc::FeatureState> states;
  for (const auto& state : *features) states[state.feature] = state;
  ASSERT_TRUE(states.contains(Feature::kShutter) && states.contains(Feature::kGain) &&
              states.contains(Feature::kTrigger) && states.contains(Feature::kFrameRate));
  EXPECT_TRUE(states[Feature::kShutter].absolute);
  EXPECT_NEAR(states[Feature::kShutter].absolute_max, 0.06, 1e-6);
  EXPECT_EQ(states[Feature::kBrightness].max, 255u);
  EXPECT_FALSE(states[Feature::kBrightness].can_be_auto);
}

TEST_F(IidcUsb, WhatIsSetIsReadBack) {
  auto camera = plug();
  const auto opened = link();
  ASSERT_TRUE(opened);
  const RegisterFile at = registers(*opened);
  const auto set = [&](const char* name, const char* value) {
    const auto setting = FeatureSetting::parse(name, value);
    return setting.ok() ? iidc::set_feature(at, *setting) : setting.status();
  };
  EXPECT_TRUE(set("brightness", "100").ok());
  EXPECT_EQ(iidc::read_feature(at, Feature::kBrightness)->value, 100u);
  EXPECT_TRUE(set("shutter", "auto").ok());
  EXPECT_TRUE(iidc::read_feature(at, Feature::kShutter)->automatic);
  EXPECT_TRUE(set("shutter", "abs 0.0125").ok());
  const auto shutter = iidc::read_feature(at, Feature::kShutter);
  EXPECT_FALSE(shutter->automatic);
  EXPECT_NEAR(shutter->absolute_value, 0.0125, 1e-4);
  EXPECT_TRUE(set("auto_exposure", "off").ok());
  EXPECT_FALSE(iidc::read_feature(at, Feature::kAutoExposure)->on);

  // What cannot be is refused before anything is written.
  EXPECT_EQ(set("brightness", "256").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(set("brightness", "auto").reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(set("shutter", "abs 2").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(set("zoom", "1").reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(set("colour", "1").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(set("gain", "much").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(iidc::read_feature(at, Feature::kBrightness)->value, 100u);

  EXPECT_TRUE(iidc::set_trigger(at, *iidc::TriggerSetting::parse("0,7,high")).ok());
  EXPECT_EQ(iidc::read_feature(at, Feature::kTrigger)->value, 7u << 4);
  EXPECT_EQ(iidc::set_trigger(at, *iidc::TriggerSetting::parse("14,7")).reason(), Reason::REGISTER_REFUSED);
  EXPECT_EQ(iidc::TriggerSetting::parse("3").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_TRUE(iidc::set_strobe(at, *iidc::StrobeSetting::parse("0,high,10,200")).ok());
  EXPECT_TRUE(iidc::set_strobe(at, *iidc::StrobeSetting::parse("0,off")).ok());

  // A register that takes a write and does not keep it.
  const std::uint64_t brightness = iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters + iidc::reg::kFeature;
  camera->fail([&](CameraFaults& faults) { faults.forgetful_registers.insert(brightness); });
  const Status forgotten = set("brightness", "17");
  EXPECT_EQ(forgotten.reason(), Reason::REGISTER_REFUSED);
  EXPECT_NE(forgotten.message().find("BRIGHTNESS"), std::string::npos) << forgotten.message();
}

TEST_F(IidcUsb, ASilentOrMissingRegisterIsAnError) {
  auto camera = plug();
  const auto opened = link();
  ASSERT_TRUE(opened);
  std::uint32_t quadlet = 0;
  EXPECT_EQ(opened->read(iidc::kRegisterSpace + 0x7ff'fff0, {&quadlet, 1}).reason(), Reason::IO_ERROR);
  EXPECT_EQ(opened->read(0x1234, {&quadlet, 1}).reason(), Reason::IO_ERROR);
  const std::uint64_t mute = iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters + iidc::reg::kFormatInq;
  camera->fail([&](CameraFaults& faults) { faults.mute_registers.insert(mute); });
  const Status silent = opened->read(mute, {&quadlet, 1});
  EXPECT_EQ(silent.reason(), Reason::IO_ERROR);
  EXPECT_NE(silent.message().find("no answer"), std::string::npos) << silent.message();
}

TEST_F(IidcUsb, ABadRomIsNamed) {
  auto camera = plug();
  camera->fail([](CameraFaults& faults) { faults.bad_rom = true; });
  const auto found = iidc::find_cameras(buses());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.front().address.usable.reason(), Reason::TRUNCATED) << found.front().address.usable.to_string();
  EXPECT_EQ(iidc::LiveCamera::open(buses(), {}, stop_).reason(), Reason::TRUNCATED);
}

TEST_F(IidcUsb, SetsEveryModeThatCarriesTwoEyes) {
  plug();
  const auto opened = link();
  ASSERT_TRUE(opened);
  const RegisterFile at = registers(*opened);
  const auto set = [&](const char* mode, double rate = 0, int width = 0, int height = 0) {
    iidc::StreamWish wish;
    if (mode) wish.mode = iidc::VideoMode::parse(mode);
    wish.rate_hz = rate;
    wish.width = width;
    wish.height = height;
    return iidc::set_stream(at, wish);
  };
  const auto best = set(nullptr);
  ASSERT_TRUE(best.ok()) << best.status().to_string();
  EXPECT_EQ(best->mode.name(), "format7.3");
  EXPECT_EQ(best->image_bytes, 2u * 640 * 480);
  EXPECT_GE(best->frame_bytes, best->image_bytes);
  const auto slow = set("format7.3", 15);
  ASSERT_TRUE(slow.ok()) << slow.status().to_string();
  EXPECT_NEAR(slow->rate_hz, 15, 0.5);
  const auto small = set("format7.3", 0, 320, 240);
  ASSERT_TRUE(small.ok()) << small.status().to_string();
  EXPECT_GE(small->frame_bytes, 2u * 320 * 240);
  EXPECT_EQ(set("format7.3", 0, 321, 240).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(set("format7.3", 0, 1280, 960).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(set("format7.0").reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(set("format7.5").reason(), Reason::UNSUPPORTED);
  const auto fixed = set("format0.6", 10);
  ASSERT_TRUE(fixed.ok()) << fixed.status().to_string();
  EXPECT_EQ(fixed->rate_hz, 15);  // the slowest that is no slower
  EXPECT_EQ(fixed->frame_bytes, 2u * 640 * 480);
  const auto large = set("format2.6");
  ASSERT_TRUE(large.ok()) << large.status().to_string();
  EXPECT_EQ(large->width, 1280);
}

// Reads ten seconds of 640 x 480 x 2 at 48 frames/s. Every frame comes whole and in order, or is counted as lost.
// Returns how many were lost. `next` is the number of the frame to come.
std::uint64_t lost_in_ten_seconds(iidc::LiveCamera& live, std::uint64_t& next) {
  const std::uint64_t before = live.counts().lost;
  Watched seen;
  watch(live, seen, [&] { return seen.frames() + seen.torn >= 480; });
  EXPECT_EQ(seen.torn, 0u);
  std::uint64_t missing = 0;
  for (const std::uint64_t number : seen.numbers) {
    EXPECT_GE(number, next) << "none comes twice";
    missing += number - next;
    next = number + 1;
  }
  const std::uint64_t told = seen.gaps[Reason::CAPTURE_FAILED];
  EXPECT_EQ(seen.gaps.size(), 1u) << "no other fault";
  EXPECT_LE(told, missing);
  EXPECT_EQ(told > 0, missing > 0) << "what is missing is told of";
  EXPECT_EQ(live.counts().lost - before, missing);
  return missing;
}

class StreamingIidcUsb : public IidcUsb {
 protected:
  // How many frames of as many times ten seconds were lost.
  std::uint64_t lost_in(int tens, const LiveOptions& options) {
    const auto camera = plug();
    const auto live = open(options);
    if (!live) return 0;
    EXPECT_EQ(live->format().image_bytes, 614'400u);
    EXPECT_NEAR(live->format().rate_hz, 48, 0.5);
    std::uint64_t next = 0, lost = 0;
    for (int ten = 0; ten < tens; ++ten) lost += lost_in_ten_seconds(*live, next);
    EXPECT_LE(testbed_.counters(camera).lost, live->counts().lost) << "the bus lost none that the driver did not count";
    EXPECT_EQ(testbed_.counters(camera).cut, 0u);
    testbed_.unplug(camera);
    return lost;
  }

  // All frames come. On a machine so busy that this process gets no processor for longer than the buffers of robots
  // last, they come if there are more buffers.
  void streams_without_loss(int tens) {
    const std::uint64_t lost = lost_in(tens, {});
    if (lost == 0) return;
    std::printf("%llu frames were lost on a busy machine; again, with more buffers\n",
                static_cast<unsigned long long>(lost));
    EXPECT_EQ(lost_in(tens, patient()), 0u);
  }
};

TEST_F(StreamingIidcUsb, LosesAndTearsNoFrame) { streams_without_loss(1); }

class LongIidcUsb : public StreamingIidcUsb {};

TEST_F(LongIidcUsb, LosesAndTearsNoFrameInAMinute) { streams_without_loss(6); }

std::int64_t utc_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// When a camera's clock showed a cycle time, not more than a minute ago.
std::int64_t utc_of(const SimulatedCamera& camera, std::uint32_t cycle) {
  const double age_s =
      std::remainder(iidc::cycle_seconds(camera.cycle_time(SimulatedCamera::Clock::now())) - iidc::cycle_seconds(cycle),
                     128) /
      (1 + 1e-6 * camera.options().clock_drift_ppm);
  return utc_us() - std::llround(1e6 * age_s);
}

TEST_F(IidcUsb, StampsFramesByTheCamerasClock) {
  SimulatedCameraOptions drifting;
  drifting.clock_drift_ppm = 60;
  const auto camera = plug(drifting);
  LiveOptions options = patient();
  options.wish.rate_hz = 20;
  const std::int64_t begin = utc_us();
  const auto live = open(options);
  ASSERT_TRUE(live);
  EXPECT_TRUE(live->stamped());
  // From one reading of the camera's clock to the next, a second later, intervals are those of the camera but for its
  // drift: 3 us each. Arrivals are never so steady for so long.
  Watched seen;
  const auto steady = [&] {
    if (seen.frames() < 16) return false;
    for (std::size_t i = seen.frames() - 15; i < seen.frames(); ++i) {
      const double camera_s =
          std::remainder(iidc::cycle_seconds(seen.cycles[i]) - iidc::cycle_seconds(seen.cycles[i - 1]), 128);
      if (std::abs(static_cast<double>(seen.times_us[i] - seen.times_us[i - 1]) - 1e6 * camera_s) > 5) return false;
    }
    return true;
  };
  watch(*live, seen, steady);
  ASSERT_TRUE(steady());
  // The driver trusts no reading that took longer than 20 ms, so it knows the camera's clock to half of that.
  EXPECT_NEAR(static_cast<double>(seen.times_us.back()), static_cast<double>(utc_of(*camera, seen.cycles.back())),
              11'000);
  EXPECT_GT(seen.times_us.front(), begin) << "no frame was taken before the camera was asked for it";
  EXPECT_LT(seen.times_us.back(), utc_us()) << "nor after it came";
}

struct Fault {
  const char* name;
  std::function<void(CameraFaults&)> inject;
  Reason reason;
  std::uint64_t lost;  // frames at most, besides those that the bus lost since it had no transfer to write to
  double rate_hz = 0;  // 21: packets that do not divide a frame
};

class IidcUsbFaults : public IidcUsb, public ::testing::WithParamInterface<Fault> {};

// Each is named, counted, and over: what comes after is whole and in order.
TEST_P(IidcUsbFaults, IsNamedCountedAndRecoveredFrom) {
  auto camera = plug();
  LiveOptions options = patient();
  options.wish.rate_hz = GetParam().rate_hz;
  const auto live = open(options);
  ASSERT_TRUE(live);
  Watched before;
  watch(*live, before, [&] { return before.frames() >= 10; });
  EXPECT_TRUE(before.gaps.empty());
  camera->fail(GetParam().inject);
  Watched seen;
  watch(*live, seen, [&] { return seen.gaps.contains(GetParam().reason); });
  EXPECT_EQ(seen.gaps[GetParam().reason], 1u);
  EXPECT_EQ(live->counts().faults[GetParam().reason], 1u);
  Watched after;
  watch(*live, after, [&] { return after.frames() >= 20; });
  EXPECT_EQ(after.torn, 0u);
  EXPECT_TRUE(after.gaps.empty()) << reason_name(after.gaps.begin()->first);
  for (std::size_t i = 1; i < after.numbers.size(); ++i) ASSERT_EQ(after.numbers[i], after.numbers[i - 1] + 1) << i;
  EXPECT_LE(live->counts().lost, GetParam().lost + testbed_.counters(camera).lost);
  // Every frame that the camera took came, or was counted.
  const std::uint64_t received = before.frames() + seen.frames() + after.frames() + seen.torn;
  EXPECT_EQ(received + live->counts().lost, after.numbers.back() + 1);
}

INSTANTIATE_TEST_SUITE_P(
    Each, IidcUsbFaults,
    ::testing::Values(Fault{"Short", [](CameraFaults& f) { f.short_frames = 1; }, Reason::SHORT_FRAME, 1},
                      Fault{"Long", [](CameraFaults& f) { f.long_frames = 1; }, Reason::SHORT_FRAME, 1},
                      Fault{"Babble", [](CameraFaults& f) { f.long_frames = 1; }, Reason::FRAME_DAMAGED, 2, 21},
                      Fault{"Shifted", [](CameraFaults& f) { f.shifted_frames = 1; }, Reason::SHORT_FRAME, 1},
                      Fault{"Stall", [](CameraFaults& f) { f.stalls = 1; }, Reason::CAMERA_STALLED, 0},
                      Fault{"Silence", [](CameraFaults& f) { f.silence = 1500ms; }, Reason::CAMERA_SILENT, 90}),
    [](const auto& fault) { return std::string(fault.param.name); });

// A stall costs few frames. How many depends on when this process gets a processor, so that of ten stalls one has to.
TEST_F(IidcUsb, AHaltedStreamGoesOnSoon) {
  auto camera = plug();
  const auto live = open();
  ASSERT_TRUE(live);
  std::uint64_t lost = ~0ull;
  Watched seen;
  for (int stall = 0; stall < 10 && lost > 6; ++stall) {
    const std::uint64_t before = live->counts().lost, stalls = seen.gaps[Reason::CAMERA_STALLED];
    camera->fail([](CameraFaults& faults) { faults.stalls = 1; });
    watch(*live, seen, [&] { return seen.gaps[Reason::CAMERA_STALLED] > stalls; });
    const std::uint64_t frames = seen.frames();
    watch(*live, seen, [&] { return seen.frames() >= frames + 5; });
    lost = live->counts().lost - before;
  }
  EXPECT_LE(lost, 6u);
}

// The report of a halt covers what was lost by it, and nothing later.
TEST_F(IidcUsb, ALossAfterAHaltIsReported) {
  const auto camera = plug();
  const auto live = open(LiveOptions());
  ASSERT_TRUE(live);
  Watched seen;
  watch(*live, seen, [&] { return seen.frames() >= 5; });
  camera->fail([](CameraFaults& faults) { faults.stalls = 1; });
  watch(*live, seen, [&] { return seen.gaps[Reason::CAMERA_STALLED] > 0; });
  const std::uint64_t sent = testbed_.counters(camera).frames, losses = seen.gaps[Reason::CAPTURE_FAILED];
  watch(*live, seen, [&] { return testbed_.counters(camera).frames >= sent + 5; });
  EXPECT_TRUE(eventually([&] { return testbed_.counters(camera).frames >= sent + 60; }));
  const std::uint64_t frames = seen.frames();
  watch(*live, seen, [&] { return seen.frames() >= frames + 30; });
  EXPECT_GT(seen.gaps[Reason::CAPTURE_FAILED], losses);
}

TEST_F(IidcUsb, FramesThatNobodyTakesAreGivenUpAndCounted) {
  const auto camera = plug();
  const auto live = open(LiveOptions());
  ASSERT_TRUE(live);
  Watched before;
  watch(*live, before, [&] { return before.frames() >= 5; });
  const std::uint64_t sent = testbed_.counters(camera).frames;
  EXPECT_TRUE(eventually([&] { return testbed_.counters(camera).frames >= sent + 48; }));
  Watched after;
  watch(*live, after, [&] { return after.frames() >= 30; });
  EXPECT_EQ(after.torn, 0u);
  EXPECT_GE(after.gaps[Reason::CAPTURE_FAILED], 1u);
  EXPECT_GE(live->counts().lost, 30u);
  const std::uint64_t came = before.frames() + after.frames();
  EXPECT_LE(before.unknown, testbed_.counters(camera).lost);
  EXPECT_EQ(came + live->counts().lost + before.unknown, after.numbers.back() + 1) << "each came, or is counted";
}

TEST_F(IidcUsb, AnEyeThatIsDeadIsMissingFromPairsAndNamed) {
  auto camera = plug();
  const storage::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "12345678");
  std::ofstream(folder / "12345678/calib.txt") << "P0: 500 0 320 0 0 500 240 0 0 0 1 0\n"
                                                  "P1: 500 0 320 -60 0 500 240 0 0 0 1 0\n";
  auto source = iidc::IidcSource::open(buses(), {.serial = "", .camera_folder = folder / "", .calibration = ""}, stop_);
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_NEAR((*source)->camera().baseline, 0.12, 1e-9);
  const auto whole = (*source)->next();
  ASSERT_TRUE(whole.ok() && whole->has_value());
  EXPECT_TRUE((*whole)->eye_missing.ok());
  EXPECT_TRUE((*whole)->arrived);
  camera->fail([](CameraFaults& faults) { faults.dead_eye = capture::FirstByte::kRight; });
  // Some were on their way; from the first that lacks the eye on, all do. A busy machine may miss some.
  int without = 0;
  for (int i = 0; i < 200 && without < 10; ++i) {
    const auto pair = (*source)->next();
    if (pair.reason() == Reason::CAPTURE_FAILED) continue;
    ASSERT_TRUE(pair.ok() && pair->has_value()) << pair.status().to_string();
    EXPECT_FALSE((*pair)->left.empty());
    if (without == 0 && !(*pair)->right.empty()) continue;
    ++without;
    EXPECT_TRUE((*pair)->right.empty());
    EXPECT_EQ((*pair)->eye_missing.reason(), Reason::EYE_DEAD);
  }
  EXPECT_EQ(without, 10);
}

// How many frames are lost meanwhile depends on when this process gets a processor, so that one of three runs has to
// lose no more than come in two seconds.
TEST_F(IidcUsb, AClockThatDoesNotAnswerHoldsNoFramesUpForLong) {
  const std::uint64_t clock = iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters + iidc::pgr::kCycleTime;
  std::uint64_t lost = ~0ull;
  for (int run = 0; run < 3 && lost > 2 * 48u; ++run) {
    auto camera = plug();
    camera->fail([&](CameraFaults& faults) { faults.mute_registers.insert(clock); });
    const auto start = std::chrono::steady_clock::now();
    const auto live = open(LiveOptions());
    ASSERT_TRUE(live);
    Watched seen;
    watch(*live, seen, [&] { return seen.frames() >= 150; });
    // Each answer that does not come is waited for, and the pause before the next question doubles from two seconds on.
    const double passed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    EXPECT_GE(testbed_.counters(camera).unanswered, 1u);
    EXPECT_LE(testbed_.counters(camera).unanswered, std::log2(passed_s + 2));
    EXPECT_EQ(seen.torn, 0u);
    lost = live->counts().lost;
    EXPECT_LE(seen.unknown, testbed_.counters(camera).lost);
    EXPECT_EQ(seen.frames() + lost + seen.unknown, seen.numbers.back() + 1) << "each came, or is counted";
    testbed_.unplug(camera);
  }
  EXPECT_LE(lost, 2 * 48u);
}

TEST_F(IidcUsb, ASecondProgramDoesNotDisturbTheFirst) {
  auto camera = plug();
  const auto first = open();
  ASSERT_TRUE(first);
  Watched seen;
  watch(*first, seen, [&] { return seen.frames() >= 5; });
  LiveOptions other;
  other.wish.width = 320;
  other.wish.height = 240;
  std::thread second([&] {
    for (int i = 0; i < 3; ++i) EXPECT_EQ(iidc::LiveCamera::open(buses(), other, stop_).reason(), Reason::CAMERA_BUSY);
  });
  watch(*first, seen, [&] { return seen.frames() >= 60; });
  second.join();
  EXPECT_TRUE(seen.gaps.empty());
  EXPECT_EQ(seen.torn, 0u);
  EXPECT_EQ(first->counts().lost, 0u);
}

TEST_F(IidcUsb, ACameraThatForgotItsSettingsIsSetUpAgain) {
  auto camera = plug();
  LiveOptions options = patient();
  options.features.push_back(*FeatureSetting::parse("brightness", "100"));
  const auto live = open(options);
  ASSERT_TRUE(live);
  Watched before;
  watch(*live, before, [&] { return before.frames() >= 5; });
  camera->restart();
  Watched seen;
  watch(*live, seen, [&] { return seen.frames() >= 30 && live->counts().reopened > 0; });
  EXPECT_EQ(seen.torn, 0u);
  EXPECT_GE(seen.gaps[Reason::CAMERA_SILENT], 1u);
  const auto opened = link();
  ASSERT_TRUE(opened);
  EXPECT_EQ(iidc::read_feature(registers(*opened), Feature::kBrightness)->value, 100u);
}

TEST_F(IidcUsb, WaitingForATriggerIsNotReportedAsSilence) {
  auto camera = plug();
  LiveOptions options = patient();
  options.trigger = *iidc::TriggerSetting::parse("0,0");
  const auto live = open(options);
  ASSERT_TRUE(live);
  std::atomic<bool> enough = false;
  std::thread hand([&] {  // an edge that comes while a busy camera has not seen the one before is the same edge
    for (std::this_thread::sleep_for(2500ms); !enough; std::this_thread::sleep_for(100ms)) camera->trigger();
  });
  Watched seen;
  watch(*live, seen, [&] { return seen.frames() >= 3; });
  enough = true;
  hand.join();
  EXPECT_TRUE(seen.gaps.empty());
  EXPECT_EQ(live->counts().begun_anew, 0u);
}

TEST_F(IidcUsb, AnotherProgramHasTheStream) {
  auto camera = plug();
  camera->fail([](CameraFaults& faults) { faults.busy = true; });
  EXPECT_EQ(iidc::LiveCamera::open(buses(), {}, stop_).reason(), Reason::CAMERA_BUSY);
  // Its settings can be read all the same.
  const auto opened = link();
  ASSERT_TRUE(opened);
  EXPECT_TRUE(iidc::read_features(registers(*opened)).ok());
}

TEST_F(IidcUsb, TheBusHasNoRoom) {
  auto camera = plug();
  camera->fail([](CameraFaults& faults) { faults.no_bandwidth = true; });
  EXPECT_EQ(iidc::LiveCamera::open(buses(), {}, stop_).reason(), Reason::NO_BANDWIDTH);
  camera->fail([](CameraFaults& faults) { faults.no_bandwidth = false; });
  const auto live = open();
  ASSERT_TRUE(live);
  Watched seen;
  watch(*live, seen, [&] { return seen.frames() >= 5; });
  EXPECT_EQ(seen.frames(), 5u);
}

TEST_F(IidcUsb, UnpluggedInMidFrameItIsWaitedForAndGoesOn) {
  auto camera = plug();
  const auto live = open();
  ASSERT_TRUE(live);
  Watched before;
  watch(*live, before, [&] { return before.frames() >= 10; });
  std::thread hand([&] {
    EXPECT_TRUE(testbed_.unplug_in_mid_frame(camera));
    std::this_thread::sleep_for(300ms);
    testbed_.plug(camera);
  });
  Watched seen;
  watch(*live, seen, [&] { return live->counts().reopened == 1 && seen.frames() > 60; });
  hand.join();
  EXPECT_EQ(seen.gaps[Reason::CAMERA_GONE], 1u);
  EXPECT_EQ(seen.torn, 0u);
}

TEST_F(IidcUsb, StopsSoonWhileTheCameraIsAway) {
  auto camera = plug();
  const auto live = open();
  ASSERT_TRUE(live);
  testbed_.unplug(camera);
  std::thread stopper([&] {
    std::this_thread::sleep_for(500ms);
    stop_ = true;
  });
  int asked_since = 0;  // while it is asked to stop
  for (;;) {
    asked_since += stop_;
    const auto frame = live->next();
    if (frame.ok() && !frame->has_value()) break;
  }
  stopper.join();
  EXPECT_LE(asked_since, 1);
}

void replug(UsbTestbed& testbed, iidc::LiveCamera* live, const std::shared_ptr<SimulatedCamera>& camera, int cycles) {
  ASSERT_TRUE(live);
  Watched seen;
  std::size_t threads_at_first = 0, others_at_first = 0;
  for (int cycle = 1; cycle <= cycles; ++cycle) {
    const std::uint64_t had = seen.frames();
    watch(*live, seen, [&] { return seen.frames() >= had + 5; });
    testbed.unplug(camera);
    std::thread hand([&] {
      std::this_thread::sleep_for(50ms);
      testbed.plug(camera);
    });
    watch(*live, seen, [&] { return live->counts().reopened == static_cast<std::uint64_t>(cycle); });
    hand.join();
    if (cycle == 3) threads_at_first = threads(), others_at_first = files().others;
    ASSERT_FALSE(::testing::Test::HasFailure()) << "cycle " << cycle;
  }
  EXPECT_EQ(seen.torn, 0u);
  EXPECT_EQ(seen.gaps[Reason::CAMERA_GONE], static_cast<std::uint64_t>(cycles));
  EXPECT_LE(threads(), threads_at_first);
  EXPECT_LE(files().others, others_at_first);
  EXPECT_LE(files().devices, static_cast<std::size_t>(cycles) + 2);  // the one that is there has two ends
}

TEST_F(IidcUsb, TwentyTimesUnpluggedAndPluggedInAgain) {
  auto camera = plug();
  const auto live = open();
  replug(testbed_, live.get(), camera, 20);
}

TEST_F(LongIidcUsb, AHundredTimesUnpluggedAndPluggedInAgain) {
  auto camera = plug();
  const auto live = open();
  replug(testbed_, live.get(), camera, 100);
}

}  // namespace
}  // namespace relmap::testing
