// A simulated camera on a simulated bus, and our own driver at the other end.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "frontend/capture/iidc/identity.h"
#include "frontend/capture/iidc/live_camera.h"
#include "frontend/capture/iidc/usb_bus.h"
#include "tests/camera/simulated_camera.h"
#include "tests/camera/usb_testbed.h"

namespace relmap::testing {

class IidcFixture : public ::testing::Test {
 protected:
  using Buses = std::vector<std::shared_ptr<iidc::CameraBus>>;

  std::shared_ptr<SimulatedCamera> plug(SimulatedCameraOptions options = {},
                                        UsbTestbed::Access access = UsbTestbed::Access::kAll) {
    auto camera = std::make_shared<SimulatedCamera>(std::move(options));
    testbed_.plug(camera, access);
    return camera;
  }

  Buses buses() {
    if (!usb_) {
      auto bus = iidc::open_usb_bus();
      EXPECT_TRUE(bus.ok()) << bus.status().to_string();
      usb_ = *bus;
    }
    return {usb_};
  }

  // Buffers for more than a second: a busy machine may give this process no processor for longer than the usual ones
  // last (170 ms), and the frames that it loses then say nothing of the driver.
  static iidc::LiveOptions patient() {
    iidc::LiveOptions options;
    options.buffers = 128;
    return options;
  }

  std::unique_ptr<iidc::LiveCamera> open(const iidc::LiveOptions& options = patient()) {
    auto live = iidc::LiveCamera::open(buses(), options, stop_);
    EXPECT_TRUE(live.ok()) << live.status().to_string();
    return live.ok() ? std::move(*live) : nullptr;
  }

  static bool eventually(const std::function<bool()>& holds, std::chrono::seconds patience = std::chrono::seconds(60)) {
    const auto until = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < until) {
      if (holds()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return holds();
  }

  UsbTestbed testbed_;
  std::atomic<bool> stop_ = false;
  std::shared_ptr<iidc::CameraBus> usb_;
};

// What a camera has delivered.
struct Watched {
  std::vector<std::uint64_t> numbers;  // of default_frame()s, in order
  std::uint64_t torn = 0;
  std::map<Reason, std::uint64_t> gaps;
  std::vector<std::int64_t> times_us;
  std::vector<std::uint32_t> cycles;  // the camera's own stamps; 0 if it has none
  // Frames before the first of a stream that the driver cannot know of: those that the bus lost between others that
  // were not taken in time. Zero, unless some were not.
  std::uint64_t unknown = 0;

  std::uint64_t frames() const { return numbers.size(); }
};

// Reads frames until `enough` returns true; fails the test after a minute.
inline void watch(iidc::LiveCamera& live, Watched& seen, const std::function<bool()>& enough) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!enough() && std::chrono::steady_clock::now() < until) {
    const auto frame = live.next();
    if (!frame.ok()) {
      ++seen.gaps[frame.reason()];
      continue;
    }
    if (!frame->has_value()) return;
    if (const auto number = default_frame_number((*frame)->raw.bytes())) {
      if (seen.numbers.empty() && seen.torn == 0 && (*frame)->index > 0) seen.unknown = *number - (*frame)->index;
      seen.numbers.push_back(*number);
    } else {
      ++seen.torn;
    }
    seen.times_us.push_back((*frame)->time_us);
    seen.cycles.push_back((*frame)->cycle.value_or(0));
  }
  EXPECT_LT(std::chrono::steady_clock::now(), until) << "a minute was not enough";
}

}  // namespace relmap::testing
