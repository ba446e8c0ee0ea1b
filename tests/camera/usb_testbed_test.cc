// The simulated camera under drivers that know nothing of it: libusb itself, and libdc1394.
#include "tests/camera/usb_testbed.h"

#include <dc1394/dc1394.h>
#include <gtest/gtest.h>
#include <libusb-1.0/libusb.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "frontend/capture/iidc/registers.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
namespace reg = iidc::reg;

constexpr std::uint64_t kBase = iidc::kRegisterSpace + SimulatedCamera::kCommandRegisters;

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

  // The only camera's.
  int open() {
    libusb_device** list = nullptr;
    const auto count = libusb_get_device_list(context_, &list);
    const int opened = count > 0 ? libusb_open(list[count - 1], &handle_) : static_cast<int>(LIBUSB_ERROR_NO_DEVICE);
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
    handle_events(seconds(2), [&] { return pending_ == 0; });
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
    }
    return until();
  }
  bool wait_for(std::size_t count, std::chrono::milliseconds patience = seconds(3)) {
    return handle_events(patience, [&] { return came.size() >= count; });
  }
  int pending() const { return pending_; }

  std::vector<Came> came;
  bool again = true;
  int refused = 0;

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

constexpr std::size_t kContent = 640 * 480 * 2;

class UsbTestbedTest : public ::testing::Test {
 protected:
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

  const std::shared_ptr<SimulatedCamera> camera = std::make_shared<SimulatedCamera>();
  UsbTestbed testbed;
  Usb usb;
  std::size_t frame_bytes = 0;
};

TEST_F(UsbTestbedTest, EveryFrameOfAFastStreamComesWhole) {
  open();
  const double before = processor_seconds();
  Stream stream(usb, frame_bytes, kContent, 16);  // a third of a second of patience with a loaded machine
  usb.write(kBase + reg::kIsoEnable, iidc::kOn);
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(stream.wait_for(144, seconds(10)));
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  RecordProperty("processor_percent", static_cast<int>(100 * (processor_seconds() - before) / took));
  std::printf("CPU %.1f %%, %.2f s\n", 100 * (processor_seconds() - before) / took, took);
  usb.write(kBase + reg::kIsoEnable, 0);
  for (std::size_t i = 0; i < 144; ++i) {
    EXPECT_EQ(LIBUSB_TRANSFER_COMPLETED, stream.came[i].status);
    EXPECT_EQ(frame_bytes, stream.came[i].size);
    ASSERT_EQ(i, stream.came[i].number);
  }
  EXPECT_NEAR(3.0, took, 0.3);
  EXPECT_EQ(0u, testbed.counters(camera).lost);
  EXPECT_EQ(0u, testbed.counters(camera).cut);
}

}  // namespace
}  // namespace relmap::testing
