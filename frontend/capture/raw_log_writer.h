// Writes a raw log (raw_log.h) beside the thread that captures, which never waits for the disk.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "frontend/capture/log_file.h"
#include "frontend/capture/raw_log.h"
#include "frontend/capture/raw_log_index.h"

namespace relmap::capture {

struct RawLogOptions {
  std::size_t max_waiting = std::size_t{64} << 20;  // bytes of memory for what waits for the disk
  std::chrono::milliseconds sync_every{1000};       // at most so much is lost with the machine
};

struct RawLogCounts {
  std::uint64_t frames = 0, events = 0;  // written
  std::uint64_t bytes = 0;               // of the file
  std::uint64_t dropped_frames = 0;      // there was no memory left, or the disk had failed
  std::size_t waiting = 0;               // bytes of memory now
};

// Thread-safe. What was written survives the death of its process, and but for the last second that of the machine.
class RawLogWriter {
 public:
  // Begins a log. INVALID_ARGUMENT: something of that name is there, and is not written over; BAD_SIZE: a layout of no
  // size, or of frames larger than kMaxFrameBytes; IMPLAUSIBLE_CALIBRATION; IO_ERROR, DISK_FULL.
  static Result<std::unique_ptr<RawLogWriter>> open(const std::string& path, RawLogHeader header,
                                                    const RawLogOptions& options = {});
  ~RawLogWriter();  // as close()

  // Both copy what they are given, and return at once. DROPPED_BY_ROBOT: too much waits for the disk; the log will say
  // how many frames and events were dropped, in an event of that reason. IO_ERROR, DISK_FULL: the disk has failed, and
  // nothing is written any more; the log is whole up to there. WRONG_STATE: closed. BAD_SIZE, of frames: other sizes
  // than the layout's with up to kMaxFrameBytes in all. INVALID_ARGUMENT, of events: a reason that is none.
  Status add_frame(const RawLogFrame& frame, ByteSpan raw);
  Status add_event(const RawLogEvent& event);

  // Returns when all is on disk. IO_ERROR, DISK_FULL, whenever it was.
  Status close();

  RawLogCounts counts() const;

 private:
  struct Item {
    raw_log::Head head;
    Bytes body;
    std::size_t memory() const { return sizeof(Item) + body.size(); }
  };

  RawLogWriter(LogFile file, std::size_t frame_bytes, const RawLogOptions& options);
  Status begin(const RawLogHeader& header);
  Status write_beginning(const RawLogHeader& header);
  Status add(const raw_log::Head& head, ByteSpan body);
  void count_dropped(const raw_log::Head& head);
  void tell_of_dropped();
  void run();
  Status write(Item& item);
  Status sync();
  void fail(const Status& status);

  const RawLogOptions options_;
  const std::size_t frame_bytes_;  // of a frame at least
  LogFile file_;
  RawLogIndexWriter index_;  // these two are the thread's, once it runs

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<Item> queue_;
  RawLogCounts counts_;
  std::uint64_t dropped_frames_ = 0, dropped_events_ = 0;  // that the log has not been told of
  std::int64_t dropped_us_ = 0;                            // the first of them
  Status failure_;
  bool closing_ = false;
  std::thread thread_;
};

}  // namespace relmap::capture
