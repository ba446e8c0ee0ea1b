// Writes a raw log (raw_log.h) on a thread of its own, so that the capturing thread never waits for the disk.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <thread>

#include "frontend/capture/log_file.h"
#include "frontend/capture/raw_log.h"
#include "frontend/capture/raw_log_index.h"
#include "proto/base/mutex.h"

namespace relmap::capture {

struct RawLogOptions {
  std::size_t max_waiting = std::size_t{64} << 20;  // maximum bytes of memory that wait for the disk
  std::chrono::milliseconds sync_every{1000};       // at most this much is lost if the machine crashes
};

struct RawLogCounts {
  std::uint64_t frames = 0, events = 0;  // written
  std::uint64_t bytes = 0;               // of the file
  std::uint64_t dropped_frames = 0;      // because the memory was full, or the disk had failed
  std::size_t waiting = 0;               // bytes that wait for the disk now
};

// What was written survives a crash of the process and, except for the last second, of the machine. Thread-safe.
class RawLogWriter {
 public:
  // Begins a log. INVALID_ARGUMENT if a file of that name exists, which is not overwritten; BAD_SIZE if the layout has
  // no size, or its frames are larger than kMaxFrameBytes; IMPLAUSIBLE_CALIBRATION; IO_ERROR, DISK_FULL.
  static Result<std::unique_ptr<RawLogWriter>> open(const std::string& path, RawLogHeader header,
                                                    const RawLogOptions& options = {});
  ~RawLogWriter();  // like close()

  // Both copy their arguments and do not block. DROPPED_BY_ROBOT if too much waits for the disk; an event of that
  // reason in the log will state how many frames and events were dropped. IO_ERROR or DISK_FULL if the disk has failed;
  // nothing more is written then, and the log is intact up to there. WRONG_STATE after close(). BAD_SIZE if a frame is
  // smaller than the layout or larger than kMaxFrameBytes. INVALID_ARGUMENT if an event has no valid reason.
  Status add_frame(const RawLogFrame& frame, ByteSpan raw);
  Status add_event(const RawLogEvent& event);

  // Returns when everything is on disk. IO_ERROR, DISK_FULL if any write failed.
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
  void count_dropped(const raw_log::Head& head) RELMAP_REQUIRES(mutex_);
  void tell_of_dropped() RELMAP_REQUIRES(mutex_);
  void run();
  Status write(Item& item);
  Status sync();
  void fail(const Status& status) RELMAP_REQUIRES(mutex_);

  const RawLogOptions options_;
  const std::size_t frame_bytes_;  // minimum size of a frame
  LogFile file_;
  RawLogIndexWriter index_;  // file_ and index_ belong to the thread once it runs

  mutable Mutex mutex_;
  ConditionVariable changed_;
  std::deque<Item> queue_ RELMAP_GUARDED_BY(mutex_);
  RawLogCounts counts_ RELMAP_GUARDED_BY(mutex_);
  std::uint64_t dropped_frames_ RELMAP_GUARDED_BY(mutex_) = 0, dropped_events_ RELMAP_GUARDED_BY(mutex_) =
                                                                   0;  // that no event in the log states yet
  std::int64_t dropped_us_ RELMAP_GUARDED_BY(mutex_) = 0;              // time of the first of them
  Status failure_ RELMAP_GUARDED_BY(mutex_);
  bool closing_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace relmap::capture
