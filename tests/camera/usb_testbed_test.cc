// The simulated camera under unmodified drivers: libusb itself, and libdc1394.
#include "tests/camera/usb_testbed.h"

#include <gtest/gtest.h>
#include <libusb-1.0/libusb.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "frontend/capture/iidc/registers.h"
#include "tests/camera/under_mock.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
namespace reg = iidc::reg;

constexpr std::uint64_t kBase = iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters;

const double kRate = built_with_sanitizer() ? 12 : 48;

double processor_seconds() {
  rusage usage;
  ::getrusage(RUSAGE_SELF, &usage);
  const auto of = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return of(usage.ru_utime) + of(usage.ru_stime);
}

// libusb, as a driver would use it.
class Usb {
 public:
  Usb() { EXPECT_EQ(0, libusb_init(&context_)); }
  ~Usb() {
    close();
    libusb_exit(context_);
  }
  Usb(const Usb&) = delete;
  Usb& operator=(const Usb&) = delete;

  libusb_context* context() const { return context_; }
  libusb_device_handle* handle() const { return handle_; }

  // The newest camera's.
  int open() {
    libusb_device** list = nullptr;
    const auto count = libusb_get_device_list(context_, &list);
    int opened = LIBUSB_ERROR_NO_DEVICE;
    if (count > 0)
      opened = libusb_open(*std::max_element(list, list + count,
                                             [](libusb_device* a, libusb_device* b) {
                                               return libusb_get_device_address(a) < libusb_get_device_address(b);
                                             }),
                           &handle_);
    libusb_free_device_list(list, 1);
    return opened;
  }
  void close() {
    if (handle_) libusb_close(handle_);
    handle_ = nullptr;
  }
  int read(std::uint64_t address, std::uint32_t& quadlet, unsigned patience_ms = 1000) {
    unsigned char bytes[4];
    const int count =
        libusb_control_transfer(handle_, 0xc0, 0x7f, address & 0xffff, address >> 16 & 0xffff, bytes, 4, patience_ms);
    if (count == 4) std::memcpy(&quadlet, bytes, 4);
    return count;
  }
  int write(std::uint64_t address, std::uint32_t quadlet) {
    unsigned char bytes[4];
    std::memcpy(bytes, &quadlet, 4);
    return libusb_control_transfer(handle_, 0x40, 0x7f, address & 0xffff, address >> 16 & 0xffff, bytes, 4, 1000);
  }
  void select_stereo() {
    EXPECT_EQ(4, write(kBase + reg::kCurrentFormat, 7u << 29));
    EXPECT_EQ(4, write(kBase + reg::kCurrentMode, 3u << 29));
  }

 private:
  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
};

// Transfers that are submitted again and again.
class Stream {
 public:
  struct Came {
    libusb_transfer_status status;
    std::size_t size;
    std::optional<std::uint64_t> number;
  };

  Stream(Usb& usb, std::size_t size, std::size_t content, int in_flight) : usb_(usb), content_(content) {
    for (int i = 0; i < in_flight; ++i) {
      buffers_.emplace_back(size);
      transfers_.push_back(libusb_alloc_transfer(0));
      libusb_fill_bulk_transfer(transfers_.back(), usb.handle(), 0x81, buffers_.back().data(), static_cast<int>(size),
                                &Stream::done, this, 0);
      const int submitted = libusb_submit_transfer(transfers_.back());
      if (submitted == 0)
        ++pending_;
      else
        refused = submitted;
    }
  }
  ~Stream() {
    again = false;
    for (libusb_transfer* transfer : transfers_) libusb_cancel_transfer(transfer);
    handle_events(seconds(60), [&] { return pending_ == 0; });
    EXPECT_EQ(0, pending_);
    for (libusb_transfer* transfer : transfers_) libusb_free_transfer(transfer);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  bool handle_events(std::chrono::milliseconds patience, const std::function<bool()>& until) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!until() && std::chrono::steady_clock::now() < end) {
      timeval time{0, 20'000};
      libusb_handle_events_timeout(usb_.context(), &time);
      ++rounds;
    }
    return until();
  }
  bool wait_for(std::size_t count, std::chrono::milliseconds patience = seconds(60)) {
    return handle_events(patience, [&] { return came.size() >= count; });
  }
  int pending() const { return pending_; }

  std::vector<Came> came;
  bool again = true;
  int refused = 0;
  int rounds = 0;  // how often events were waited for

 private:
  static void LIBUSB_CALL done(libusb_transfer* transfer) {
    auto& self = *static_cast<Stream*>(transfer->user_data);
    const auto size = static_cast<std::size_t>(transfer->actual_length);
    if (transfer->status != LIBUSB_TRANSFER_CANCELLED)
      self.came.push_back(
          {transfer->status, size, default_frame_number({transfer->buffer, std::min(size, self.content_)})});
    --self.pending_;
    if (self.again && transfer->status != LIBUSB_TRANSFER_NO_DEVICE && libusb_submit_transfer(transfer) == 0)
      ++self.pending_;
  }

  Usb& usb_;
  const std::size_t content_;
  std::vector<std::vector<unsigned char>> buffers_;
  std::vector<libusb_transfer*> transfers_;
  int pending_ = 0;
};

std::shared_ptr<SimulatedCamera> make_camera(int number = 0, double rate = kRate) {
  SimulatedCameraOptions options;
  options.guid += static_cast<unsigned>(number);
  options.rate = rate;
  return std::make_shared<SimulatedCamera>(options);
}

class UsbTestbedTest : public ::testing::Test {
 protected:
  explicit UsbTestbedTest(UsbTestbedOptions options = {}, double rate = kRate)
      : camera(make_camera(0, rate)), testbed(options) {}

  void open() {
    testbed.plug(camera);
    ASSERT_EQ(0, usb.open());
    ASSERT_EQ(0, libusb_claim_interface(usb.handle(), 0));
    usb.select_stereo();
    const std::uint32_t csr =
        4 * camera->command_register(reg::kFormat7CsrInq + 4 * 3) - SimulatedCamera::kCommandRegisters;
    const std::uint32_t packet = camera->command_register(csr + iidc::format7::kBytesPerPacket) >> 16;
    frame_bytes = std::size_t{packet} * camera->command_register(csr + iidc::format7::kPacketsPerFrame);
  }

  // Every frame that came is whole and in its order, and those that did not are the ones that the simulator counts.
  void stop_and_account(Usb& driver, Stream& stream, const std::shared_ptr<SimulatedCamera>& source) {
    ASSERT_EQ(4, driver.write(kBase + reg::kIsoEnable, 0));
    UsbCounters sent;
    EXPECT_TRUE(stream.handle_events(seconds(60),
                                     [&] {
                                       sent = testbed.counters(source);
                                       return sent.frames == stream.came.size() + sent.lost;
                                     }))
        << sent.frames << " sent, " << sent.lost << " lost, " << stream.came.size() << " came";
    std::uint64_t expected = 0;
    for (const Stream::Came& frame : stream.came) {
      EXPECT_EQ(LIBUSB_TRANSFER_COMPLETED, frame.status);
      EXPECT_EQ(frame_bytes, frame.size);
      ASSERT_TRUE(frame.number) << "torn, after " << expected;
      ASSERT_GE(*frame.number, expected);
      expected = *frame.number + 1;
    }
    EXPECT_EQ(stream.came.size(), sent.delivered);
    EXPECT_EQ(0u, sent.cut);
  }

  void start_sending() { ASSERT_EQ(4, usb.write(kBase + reg::kIsoEnable, iidc::kOn)); }

  const std::shared_ptr<SimulatedCamera> camera;
  UsbTestbed testbed;
  Usb usb;
  std::size_t frame_bytes = 0;
};

TEST_F(UsbTestbedTest, EveryFrameOfAFastStreamComesWhole) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 64);  // more than a second of patience with a loaded machine
  const double before = processor_seconds();
  const auto start = std::chrono::steady_clock::now();
  start_sending();
  ASSERT_TRUE(stream.wait_for(static_cast<std::size_t>(3 * kRate), seconds(60)));
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("%zu frames in %.2f s, %.1f %% of a core\n", stream.came.size(), took,
              100 * (processor_seconds() - before) / took);
  stop_and_account(usb, stream, camera);
  if (!built_with_sanitizer()) {
    EXPECT_EQ(0u, testbed.counters(camera).lost);
    EXPECT_GT(took, 2.7) << "none comes twice";
  }
}

TEST_F(UsbTestbedTest, WhoWaitsIsNotWokenForNothing) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 4);
  EXPECT_FALSE(stream.wait_for(1, seconds(1)));
  EXPECT_LE(stream.rounds, 60) << "of 20 ms each";
}

TEST_F(UsbTestbedTest, IsListedAsTheCameraThatItPlays) {
  open();
  libusb_device* const device = libusb_get_device(usb.handle());
  libusb_device_descriptor descriptor;
  ASSERT_EQ(0, libusb_get_device_descriptor(device, &descriptor));
  EXPECT_EQ(0x1e10, descriptor.idVendor);
  EXPECT_EQ(0x2004, descriptor.idProduct);
  EXPECT_EQ(LIBUSB_SPEED_HIGH, libusb_get_device_speed(device));
  EXPECT_EQ(512, libusb_get_max_packet_size(device, 0x81));
  unsigned char text[64];
  ASSERT_GT(libusb_get_string_descriptor_ascii(usb.handle(), 1, text, sizeof text), 0);
  EXPECT_STREQ("Point Grey Research", reinterpret_cast<const char*>(text));
}

TEST_F(UsbTestbedTest, RegistersAreReadAndWrittenByControlTransfers) {
  open();
  std::uint32_t quadlet = 0;
  ASSERT_EQ(4, usb.read(iidc::kConfigRom + 4, quadlet));
  EXPECT_EQ(0x31333934u, quadlet);
  ASSERT_EQ(4, usb.read(iidc::kConfigRom + 12, quadlet));
  EXPECT_EQ(0x00b09d01u, quadlet);
  EXPECT_EQ(LIBUSB_ERROR_PIPE, usb.read(iidc::kConfigRom + 0x3fc, quadlet));
  EXPECT_EQ(LIBUSB_ERROR_PIPE, usb.write(kBase + 0xffc, 1));
  ASSERT_EQ(4, usb.read(kBase + reg::kCurrentFormat, quadlet));
  EXPECT_EQ(7u << 29, quadlet);
}

TEST_F(UsbTestbedTest, RegistersAnswerWhileFramesComeToAnotherThread) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 16);
  start_sending();
  std::atomic<bool> ended = false;
  std::thread reader([&] {
    for (int i = 0; i < 300; ++i) {
      std::uint32_t quadlet = 0;
      EXPECT_EQ(4, usb.read(kBase + reg::kCurrentMode, quadlet));
      EXPECT_EQ(3u << 29, quadlet);
    }
    ended = true;
  });
  EXPECT_TRUE(stream.handle_events(seconds(60), [&] { return ended.load(); }));
  reader.join();
}

class SplitTransfers : public UsbTestbedTest {
 protected:
  // Each frame is 38 calls of the driver: at the full rate a loaded machine would not keep up.
  SplitTransfers() : UsbTestbedTest({.split_transfers = true}, 12) {}
};

TEST_F(SplitTransfers, ComeTogetherAgain) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 16);
  start_sending();
  ASSERT_TRUE(stream.wait_for(20, seconds(60)));
  stop_and_account(usb, stream, camera);
  EXPECT_GT(testbed.counters(camera).bulk_transfers, 20u * 38);
}

TEST_F(SplitTransfers, EndEarlyWithAShortFrame) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 16);
  camera->fail([](CameraFaults& faults) { faults.short_frames = 1; });
  start_sending();
  ASSERT_TRUE(stream.wait_for(3, seconds(60)));
  EXPECT_EQ(LIBUSB_TRANSFER_COMPLETED, stream.came[0].status);
  EXPECT_EQ(frame_bytes / 2, stream.came[0].size);
  EXPECT_EQ(1u, stream.came[1].number);
}

TEST_F(UsbTestbedTest, ARegisterThatDoesNotAnswerTimesOut) {
  open();
  camera->fail([](CameraFaults& faults) { faults.mute_registers = {kBase + reg::kIsoEnable}; });
  std::uint32_t quadlet = 0;
  EXPECT_EQ(LIBUSB_ERROR_TIMEOUT, usb.read(kBase + reg::kIsoEnable, quadlet, 50));
  EXPECT_EQ(4, usb.read(kBase + reg::kCurrentMode, quadlet));
  EXPECT_EQ(1u, testbed.counters(camera).discarded);
}

TEST_F(UsbTestbedTest, AFrameForWhichNoTransferWaitsIsLostAndCounted) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 2);
  stream.again = false;
  start_sending();
  ASSERT_TRUE(stream.wait_for(2));
  std::this_thread::sleep_for(milliseconds(400));
  usb.write(kBase + reg::kIsoEnable, 0);
  const UsbCounters counters = testbed.counters(camera);
  EXPECT_EQ(2u, counters.delivered);
  EXPECT_GE(counters.lost, 2u);
  EXPECT_EQ(counters.frames, counters.delivered + counters.lost + counters.cut);
}

TEST_F(UsbTestbedTest, PendingTransfersEndWhenTheCameraIsUnpluggedInMidFrame) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 4);
  start_sending();
  ASSERT_TRUE(stream.wait_for(3));
  std::thread hand([&] { EXPECT_TRUE(testbed.unplug_in_mid_frame(camera)); });
  EXPECT_TRUE(stream.handle_events(seconds(60), [&] { return stream.pending() == 0; }));
  hand.join();
  EXPECT_EQ(LIBUSB_TRANSFER_NO_DEVICE, stream.came.back().status);
  int gone = 0;
  std::size_t max_size = 0;
  for (const Stream::Came& frame : stream.came)
    if (frame.status == LIBUSB_TRANSFER_NO_DEVICE) {
      ++gone;
      max_size = std::max(max_size, frame.size);
    }
  EXPECT_EQ(4, gone);
  EXPECT_GE(2 * max_size, frame_bytes);
  EXPECT_LT(max_size, frame_bytes);
  EXPECT_EQ(1u, testbed.counters(camera).cut);
  std::uint32_t quadlet = 0;
  EXPECT_EQ(LIBUSB_ERROR_NO_DEVICE, usb.read(iidc::kConfigRom, quadlet));
  EXPECT_EQ(LIBUSB_ERROR_NO_DEVICE, Stream(usb, frame_bytes, kDefaultFrameBytes, 1).refused);
}

TEST_F(UsbTestbedTest, PluggingAndUnpluggingIsReported) {
  struct Seen {
    std::vector<int> arrived, left;
  } seen;
  libusb_hotplug_callback_handle callback;
  const auto on_event = [](libusb_context*, libusb_device* device, libusb_hotplug_event event, void* user) -> int {
    auto& all = *static_cast<Seen*>(user);
    (event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED ? all.arrived : all.left)
        .push_back(libusb_get_device_address(device));
    return 0;
  };
  ASSERT_EQ(0, libusb_hotplug_register_callback(usb.context(),
                                                LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT,
                                                0, LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
                                                LIBUSB_HOTPLUG_MATCH_ANY, on_event, &seen, &callback));
  const auto until = [&](const std::function<bool()>& done) {
    for (int i = 0; i < 100 && !done(); ++i) {
      timeval time{0, 20'000};
      libusb_handle_events_timeout(usb.context(), &time);
    }
    return done();
  };
  testbed.plug(camera);
  EXPECT_TRUE(until([&] { return seen.arrived.size() == 1; }));
  testbed.unplug(camera);
  EXPECT_TRUE(until([&] { return seen.left.size() == 1; }));
  EXPECT_EQ(seen.arrived, seen.left);
  testbed.plug(camera);
  EXPECT_TRUE(until([&] { return seen.arrived.size() == 2; }));
  EXPECT_NE(seen.arrived.front(), seen.arrived.back());
  ASSERT_EQ(0, usb.open());
  std::uint32_t quadlet = 0;
  EXPECT_EQ(4, usb.read(iidc::kConfigRom + 16, quadlet));
  EXPECT_EQ(static_cast<std::uint32_t>(camera->options().guid), quadlet);
  libusb_hotplug_deregister_callback(usb.context(), callback);
}

TEST_F(UsbTestbedTest, AStalledEndpointStaysSoUntilItIsCleared) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 3);
  stream.again = false;
  camera->fail([](CameraFaults& faults) { faults.stalls = 1; });
  start_sending();
  ASSERT_TRUE(stream.wait_for(3));
  for (const Stream::Came& transfer : stream.came) EXPECT_EQ(LIBUSB_TRANSFER_STALL, transfer.status);
  {
    Stream halted(usb, frame_bytes, kDefaultFrameBytes, 1);
    halted.again = false;
    ASSERT_TRUE(halted.wait_for(1));
    EXPECT_EQ(LIBUSB_TRANSFER_STALL, halted.came[0].status);
  }
  ASSERT_EQ(0, libusb_clear_halt(usb.handle(), 0x81));
  Stream cleared(usb, frame_bytes, kDefaultFrameBytes, 2);
  ASSERT_TRUE(cleared.wait_for(2));
  EXPECT_EQ(LIBUSB_TRANSFER_COMPLETED, cleared.came[1].status);
  EXPECT_TRUE(cleared.came[1].number);
}

TEST_F(UsbTestbedTest, FramesAreShortLongTornAndShiftedAsAsked) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 16);
  camera->fail([](CameraFaults& faults) { faults.short_frames = 1; });
  start_sending();
  ASSERT_TRUE(stream.wait_for(2));
  EXPECT_EQ(LIBUSB_TRANSFER_COMPLETED, stream.came[0].status);
  EXPECT_EQ(frame_bytes / 2, stream.came[0].size);
  EXPECT_TRUE(stream.came[1].number);

  // The first transfer from `seen` on that is as asked. On a busy machine several come before they are looked at.
  std::size_t seen = stream.came.size();
  const auto comes = [&](auto as_asked) {
    return stream.handle_events(seconds(60), [&] {
      while (seen < stream.came.size() && !as_asked(stream.came[seen])) ++seen;
      return seen < stream.came.size();
    });
  };
  camera->fail([](CameraFaults& faults) { faults.torn_frames = 1; });
  ASSERT_TRUE(comes([](const auto& transfer) { return !transfer.number; }));
  EXPECT_EQ(frame_bytes, stream.came[seen].size);
  ASSERT_TRUE(stream.wait_for(seen + 2));
  EXPECT_TRUE(stream.came[seen + 1].number);

  // Babble: a packet of 512 bytes where there is room for less; its rest comes as a transfer of its own.
  camera->fail([](CameraFaults& faults) { faults.long_frames = 1; });
  seen = stream.came.size();
  ASSERT_TRUE(comes([](const auto& transfer) { return transfer.status == LIBUSB_TRANSFER_OVERFLOW; }));
  ASSERT_TRUE(stream.wait_for(seen + 3));
  EXPECT_LT(stream.came[seen + 1].size, 1000u);
  EXPECT_TRUE(stream.came[seen + 2].number);

  // The end of the frame after it is short, and what follows begins anew.
  camera->fail([](CameraFaults& faults) { faults.shifted_frames = 1; });
  seen = stream.came.size();
  ASSERT_TRUE(comes([&](const auto& transfer) { return transfer.size < frame_bytes; }));
  ASSERT_TRUE(stream.wait_for(seen + 2));
  EXPECT_TRUE(stream.came[seen + 1].number);
}

TEST_F(UsbTestbedTest, ASilenceSkipsTheFramesOfItsTime) {
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 16);
  start_sending();
  ASSERT_TRUE(stream.wait_for(2));
  camera->fail([](CameraFaults& faults) { faults.silence = milliseconds(400); });
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(stream.wait_for(stream.came.size() + 3));
  EXPECT_GT(std::chrono::steady_clock::now() - start, milliseconds(390));
  EXPECT_GE(*stream.came.back().number + 1, stream.came.size() + static_cast<std::size_t>(0.4 * kRate) - 1);
}

TEST_F(UsbTestbedTest, RefusesABusyInterfaceAndABusyBus) {
  open();
  camera->fail([](CameraFaults& faults) { faults.no_bandwidth = true; });
  EXPECT_LT(Stream(usb, frame_bytes, kDefaultFrameBytes, 1).refused, 0);
  camera->fail([](CameraFaults& faults) { faults.no_bandwidth = false; });
  Usb second;
  ASSERT_EQ(0, second.open());
  EXPECT_EQ(LIBUSB_ERROR_BUSY, libusb_claim_interface(second.handle(), 0));
  EXPECT_EQ(0, libusb_release_interface(usb.handle(), 0));
  EXPECT_EQ(0, libusb_claim_interface(second.handle(), 0));
  camera->fail([](CameraFaults& faults) { faults.busy = true; });
  EXPECT_EQ(0, libusb_release_interface(second.handle(), 0));
  EXPECT_EQ(LIBUSB_ERROR_BUSY, libusb_claim_interface(second.handle(), 0));
}

TEST_F(UsbTestbedTest, NobodyMayOpenWhatIsForbidden) {
  testbed.plug(camera, UsbTestbed::Access::kNobody);
  EXPECT_EQ(LIBUSB_ERROR_ACCESS, usb.open());
}

TEST_F(UsbTestbedTest, TwoCamerasSendSideBySide) {
  const auto other = make_camera(1);
  testbed.plug(other);
  Usb second;
  ASSERT_EQ(0, second.open());
  ASSERT_EQ(0, libusb_claim_interface(second.handle(), 0));
  second.select_stereo();
  open();
  Stream stream(usb, frame_bytes, kDefaultFrameBytes, 16), other_stream(second, frame_bytes, kDefaultFrameBytes, 16);
  start_sending();
  second.write(kBase + reg::kIsoEnable, iidc::kOn);
  std::thread thread([&] { EXPECT_TRUE(other_stream.wait_for(12, seconds(60))); });
  EXPECT_TRUE(stream.wait_for(12, seconds(60)));
  thread.join();
  stop_and_account(usb, stream, camera);
  stop_and_account(second, other_stream, other);
}

// A driver in a process of its own, that is killed while frames come.
TEST(UsbTestbedProcesses, AKilledProcessReleasesTheCamera) {
  constexpr const char* kRole = "RELMAP_TEST_DRIVER";
  constexpr std::size_t kFrame = kDefaultFrameBytes + 464;
  if (std::getenv(kRole)) {  // the bus is that of the process above
    Usb usb;
    ASSERT_EQ(0, usb.open());
    ASSERT_EQ(0, libusb_claim_interface(usb.handle(), 0));
    usb.select_stereo();
    Stream stream(usb, kFrame, kDefaultFrameBytes, 4);
    usb.write(kBase + reg::kIsoEnable, iidc::kOn);
    stream.wait_for(1'000'000, seconds(60));
    return;
  }
  const auto camera = std::make_shared<SimulatedCamera>();
  UsbTestbed testbed;
  testbed.plug(camera);
  ::setenv(kRole, "1", 1);
  const pid_t driver = ::fork();
  if (driver == 0) {
    ::execl("/proc/self/exe", "driver", "--gtest_filter=UsbTestbedProcesses.*", nullptr);
    ::_exit(127);
  }
  ::unsetenv(kRole);
  const auto end = std::chrono::steady_clock::now() + seconds(60);
  while (testbed.counters(camera).delivered < 3 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(milliseconds(10));
  EXPECT_GE(testbed.counters(camera).delivered, 3u);
  ::kill(driver, SIGKILL);
  int status = 0;
  ::waitpid(driver, &status, 0);
  Usb usb;
  ASSERT_EQ(0, usb.open());
  EXPECT_EQ(0, libusb_claim_interface(usb.handle(), 0));
  Stream stream(usb, kFrame, kDefaultFrameBytes, 4);
  EXPECT_TRUE(stream.wait_for(3));
}

}  // namespace
}  // namespace relmap::testing
