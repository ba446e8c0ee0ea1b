// A simulated camera at a USB port: its frames are written to pending transfers in real time. Statuses are negative
// errno values, as in Linux's usbfs.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/camera/simulated_camera.h"

namespace relmap::testing {

struct UsbCounters {
  std::uint64_t frames = 0;     // frames that were due, except those of a silence
  std::uint64_t delivered = 0;  // of these, all bytes were written to transfers
  std::uint64_t lost = 0;       // of these, no transfer was pending, or the endpoint was halted
  std::uint64_t cut = 0;        // of these, transfers ran out in the middle, or the camera was unplugged
  std::uint64_t bulk_transfers = 0, control_transfers = 0, discarded = 0;
  std::uint64_t unanswered = 0;  // control transfers to mute registers
  std::size_t max_waiting = 0;   // bulk transfers at once
};

// Who opened the device.
using UsbClient = const void*;

struct UsbTransfer {
  UsbClient client = nullptr;
  std::uint64_t id = 0;  // the client's
  std::shared_ptr<void> memory = {};
  std::size_t length = 0;
  bool error_if_short = false, continues = false;  // flags of usbfs

  int status = 0;
  std::size_t actual = 0;
  struct Piece {
    std::shared_ptr<const std::vector<std::uint8_t>> bytes;
    std::size_t from = 0, size = 0;
  };
  std::vector<Piece> pieces = {};

  void copy_to(std::uint8_t* buffer) const;
};

// A file that poll() reports as writable while set(true): a pipe that is full or empty.
class ReadyFile {
 public:
  explicit ReadyFile(std::string path);
  ~ReadyFile();
  ReadyFile(const ReadyFile&) = delete;
  ReadyFile& operator=(const ReadyFile&) = delete;

  void set(bool ready);

 private:
  const std::string path_;
  int file_ = -1;
  bool ready_ = true;
};

// Thread-safe.
class UsbPort {
 public:
  UsbPort(std::shared_ptr<SimulatedCamera> camera, const std::string& device_file);
  ~UsbPort();

  // These return 0 or a negative errno, like the system calls.
  int claim(UsbClient client);
  int release(UsbClient client);
  int set_configuration();
  int clear_halt();
  int reset();
  int submit_bulk(UsbTransfer transfer);
  int submit_control(UsbTransfer transfer, const std::uint8_t setup[8], const std::uint8_t* data);
  int discard(UsbClient client, std::uint64_t id);
  // Returns a finished transfer. -EAGAIN if there is none; -ENODEV if there will never be one.
  int reap(UsbClient client, UsbTransfer& transfer);
  void closed_by(UsbClient client);

  // Unplugs the camera: all pending transfers end with the bytes that they have.
  void unplug();
  bool plugged() const;
  // Waits until the middle of a frame; false if no frame begins within `patience`.
  bool wait_for_mid_frame(std::chrono::milliseconds patience);
  UsbCounters counters() const;

 private:
  struct Transmission {
    std::shared_ptr<const std::vector<std::uint8_t>> bytes;
    SimulatedCamera::Clock::time_point start, end;
    bool ends = true, cut = false;
    std::size_t sent = 0;
  };

  void run();
  void begin(SimulatedCamera::Frame frame);
  void advance(SimulatedCamera::Clock::time_point now);
  void send(std::size_t to);
  void finish_first(int status);
  void finish(UsbTransfer transfer, int status);
  void finish_all(int status);
  void end_transmission();
  void changed();

  const std::shared_ptr<SimulatedCamera> camera_;
  mutable std::mutex mutex_;
  std::condition_variable event_;
  ReadyFile ready_;
  UsbClient claimed_by_ = nullptr;
  std::deque<UsbTransfer> waiting_;  // for frames
  std::vector<UsbTransfer> unanswered_;
  std::map<UsbClient, std::deque<UsbTransfer>> done_;
  std::optional<Transmission> transmission_;
  bool halted_ = false, gone_ = false, woken_ = false;
  UsbCounters counters_;
  std::thread pacer_;
};

}  // namespace relmap::testing
