// An IIDC stereo camera without a bus: its registers, and the frames that it would send.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "frontend/capture/stereo_layout.h"
#include "tests/camera/default_frame.h"

namespace relmap::testing {

struct SimulatedCameraOptions {
  std::uint64_t guid = 0x00b0'9d01'00c0'ffee;
  std::string vendor = "Point Grey Research", model = "Bumblebee2 BB2-03S2C-38";
  std::uint32_t serial = 12345678;
  int width = 640, height = 480;    // of one eye in Format7: maximum and initial value
  double rate = 48;                 // maximum frames a second
  std::string bayer_tile = "YYYY";  // value of its register; YYYY: grey
  double clock_drift_ppm = 0;       // drift of its cycle time
  // Fills a frame in the order in which it is sent: of each pixel the right eye's byte first. Default: default_frame().
  std::function<void(std::uint64_t number, std::span<std::uint8_t> interleaved)> content = {};
};

// Of the frames that it sends with these options, without their padding.
inline constexpr std::size_t kDefaultFrameBytes = 640 * 480 * 2;

// Faults of a camera. Counts are of frames to come, and are counted down.
struct CameraFaults {
  int short_frames = 0;                         // only half of the frame is sent before its end
  int long_frames = 0;                          // 1000 bytes too many are sent
  int torn_frames = 0;                          // the second half is that of the next frame
  int shifted_frames = 0;                       // 1024 bytes are lost, and the following bytes move up
  int stalls = 0;                               // the endpoint is halted instead of sending the frame
  std::chrono::milliseconds silence{0};         // from now on, the frames of this time are never sent
  std::optional<capture::FirstByte> dead_eye;   // this eye is black
  std::set<std::uint64_t> mute_registers;       // reads and writes are never answered
  std::set<std::uint64_t> forgetful_registers;  // writes are accepted but not kept
  bool bad_rom = false;                         // a bit of the ROM is wrong, so that its unit directory is not found
  bool busy = false;                            // another driver has claimed the interface
  bool no_bandwidth = false;                    // the bus accepts no transfer of frames
};

class SimulatedCamera {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::uint32_t kCommandRegisters = 0xf0'0000;  // offset from the initial register space

  explicit SimulatedCamera(SimulatedCameraOptions options = {});

  const SimulatedCameraOptions& options() const { return options_; }

  enum class Answer { kDone, kRefused, kNone };
  Answer read(std::uint64_t address, std::uint32_t& quadlet);
  Answer write(std::uint64_t address, std::uint32_t quadlet);

  // Reads a register of which the answer is kDone; else throws std::out_of_range. For tests.
  std::uint32_t command_register(std::uint32_t offset);

  // Changes the faults.
  void fail(const std::function<void(CameraFaults&)>& change);
  CameraFaults faults() const;

  // An edge at its trigger input.
  void trigger();
  // Switches power off and on: everything is reset except the faults.
  void restart();

  struct Frame {
    std::uint64_t number = 0;         // from 0, since restart()
    std::vector<std::uint8_t> bytes;  // as sent, padding included
    bool ends = true;                 // the receiver is told where the frame ends
    bool stalls = false;              // nothing is sent: the endpoint is halted
    Clock::time_point start, end;     // on the bus
  };
  // When the next frame is due, nullopt if none is. From then on take_frame() returns it.
  std::optional<Clock::time_point> next_start() const;
  std::optional<Frame> take_frame(Clock::time_point now);
  // `call` is called without a lock held whenever next_start() may have changed.
  void on_change(std::function<void()> call);

  // The cycle time register of IEEE 1394: seconds modulo 128, cycles of 125 us, and 3072 parts of a cycle.
  std::uint32_t cycle_time(Clock::time_point at) const;

 private:
  struct Register {
    std::uint32_t value = 0, writable = 0;
  };
  struct Picture {
    int width = 0, height = 0, bytes_per_pixel = 0;
    std::uint32_t packet_bytes = 0;
    std::size_t bytes() const;
    std::uint32_t packets() const;
    Clock::duration bus_time() const;
  };

  std::uint32_t& at(std::uint32_t offset) { return registers_.at(offset).value; }
  std::uint32_t at(std::uint32_t offset) const { return registers_.at(offset).value; }
  void factory_settings();
  void add_features();
  void add_format7(int mode, int bytes_per_pixel, std::uint32_t codings, std::uint32_t coding);
  void written(std::uint32_t offset, std::uint32_t before);
  void written_feature(std::uint32_t offset, std::uint32_t before);
  void written_absolute(std::uint32_t offset, std::uint32_t before);
  void written_trigger(std::uint32_t before);
  void written_format7(std::uint32_t csr, std::uint32_t field, std::uint32_t before);
  void apply_format7(std::uint32_t csr);
  std::optional<Picture> picture() const;
  Clock::duration period(const Picture& picture) const;
  bool triggered() const;
  bool to_send() const;
  void make_content(std::uint64_t number, const Picture& picture, std::vector<std::uint8_t>& bytes) const;
  void embed(std::uint64_t number, Clock::time_point time, std::vector<std::uint8_t>& bytes) const;

  const SimulatedCameraOptions options_;
  const std::vector<std::uint32_t> rom_;
  mutable std::mutex mutex_;
  std::map<std::uint32_t, Register> registers_;   // by offset from the initial register space
  std::map<std::uint32_t, int> bytes_per_pixel_;  // of a Format7 mode, by its CSR
  CameraFaults faults_;
  Clock::time_point silent_until_{}, power_on_, previous_start_, can_start_;
  std::uint64_t next_number_ = 0;
  bool edge_ = false;
  std::function<void()> on_change_;
};

}  // namespace relmap::testing
