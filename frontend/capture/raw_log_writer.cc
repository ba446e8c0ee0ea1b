#include "frontend/capture/raw_log_writer.h"

#include <algorithm>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/crc32c.h"
#include "proto/base/mutex.h"

namespace relmap::capture {

using raw_log::Head;
using raw_log::Kind;

namespace {

constexpr std::size_t kRoomForEvent = 512;  // bytes kept free for the event that states what was dropped

}  // namespace

Result<std::unique_ptr<RawLogWriter>> RawLogWriter::open(const std::string& path, RawLogHeader header,
                                                         const RawLogOptions& options) {
  const StereoLayout& layout = header.layout;
  if (layout.width <= 0 || layout.height <= 0 || layout.bytes() > kMaxFrameBytes)
    return {Reason::BAD_SIZE,
            "a log of frames of " + std::to_string(layout.width) + " x " + std::to_string(layout.height) + " pixels"};
  if (header.calibration)
    if (Status status = header.calibration->check_plausible(); !status.ok()) return status;
  if (header.begun_us == 0) header.begun_us = now_us();
  auto file = LogFile::create(path);
  if (!file.ok()) return file.status();
  std::unique_ptr<RawLogWriter> writer(new RawLogWriter(std::move(*file), layout.bytes(), options));
  if (Status status = writer->begin(header); !status.ok()) return status;
  writer->thread_ = std::thread([log = writer.get()] { log->run(); });
  return writer;
}

RawLogWriter::RawLogWriter(LogFile file, std::size_t frame_bytes, const RawLogOptions& options)
    : options_(options), frame_bytes_(frame_bytes), file_(std::move(file)), index_(raw_log_index_path(file_.path())) {}

RawLogWriter::~RawLogWriter() { (void)close(); }

Status RawLogWriter::begin(const RawLogHeader& header) {
  Status status = write_beginning(header);
  if (!status.ok()) file_.cut(0);
  return status;
}

// The header is written twice, since a log without one is useless.
Status RawLogWriter::write_beginning(const RawLogHeader& header) {
  const Bytes magic = raw_log::encode_begin();
  if (Status status = file_.append(magic); !status.ok()) return status;
  {
    const MutexLock lock(mutex_);
    counts_.bytes = magic.size();
  }
  Item item;
  item.head.kind = Kind::kHeader;
  item.head.time_us = header.begun_us;
  item.body = raw_log::encode_header(header);
  for (int i = 0; i < 2; ++i)
    if (Status status = write(item); !status.ok()) return status;
  if (Status status = sync(); !status.ok()) return status;
  return sync_folder_of(file_.path());
}

Status RawLogWriter::add_frame(const RawLogFrame& frame, ByteSpan raw) {
  Head head;
  head.kind = Kind::kFrame;
  head.time_us = frame.time_us;
  head.number = frame.index;
  head.cycle = frame.cycle;
  if (raw.size() < frame_bytes_ || raw.size() > kMaxFrameBytes)
    return {Reason::BAD_SIZE, "a frame of " + std::to_string(raw.size()) + " bytes for a log of frames of " +
                                  std::to_string(frame_bytes_)};
  return add(head, raw);
}

Status RawLogWriter::add_event(const RawLogEvent& event) {
  if (event.reason == Reason::OK || !is_reason(static_cast<std::uint16_t>(event.reason)))
    return {Reason::INVALID_ARGUMENT, "an event without a reason: " + event.message};
  Head head;
  head.kind = Kind::kEvent;
  head.reason = event.reason;
  head.time_us = event.time_us;
  head.number = event.lost;
  return add(head, as_bytes(std::string_view(event.message).substr(0, kMaxMessage)));
}

Status RawLogWriter::add(const Head& head, ByteSpan body) {
  const MutexLock lock(mutex_);
  if (closing_) return {Reason::WRONG_STATE, file_.path() + " is closed"};
  if (!failure_.ok()) {
    counts_.dropped_frames += head.kind == Kind::kFrame;
    return failure_;
  }
  if (counts_.waiting + sizeof(Item) + body.size() + kRoomForEvent > options_.max_waiting) {
    count_dropped(head);
    return {Reason::DROPPED_BY_ROBOT, file_.path() + ": " + std::to_string(counts_.waiting) +
                                          " bytes wait for the disk; there is no memory for more"};
  }
  tell_of_dropped();
  counts_.waiting += queue_.emplace_back(Item{head, Bytes(body.begin(), body.end())}).memory();
  changed_.notify_all();
  return {};
}

void RawLogWriter::count_dropped(const Head& head) {
  if (dropped_frames_ + dropped_events_ == 0) dropped_us_ = head.time_us;
  if (head.kind == Kind::kFrame) {
    ++dropped_frames_;
    ++counts_.dropped_frames;
  } else {
    ++dropped_events_;
  }
}

// The event must come before anything that was added later.
void RawLogWriter::tell_of_dropped() {
  if (dropped_frames_ + dropped_events_ == 0) return;
  std::string message = raw_log::plural(dropped_frames_, "frame") + " dropped";
  if (dropped_events_ > 0) message += ", and word of " + raw_log::plural(dropped_events_, "fault");
  message += ": the disk did not keep up";
  Item item;
  item.head.kind = Kind::kEvent;
  item.head.reason = Reason::DROPPED_BY_ROBOT;
  item.head.time_us = dropped_us_;
  item.head.number = dropped_frames_;
  item.body.assign(message.begin(), message.end());
  counts_.waiting += item.memory();
  queue_.push_back(std::move(item));
  dropped_frames_ = dropped_events_ = 0;
}

void RawLogWriter::run() {
  auto synced = std::chrono::steady_clock::now();
  bool unsynced = false;
  MutexLock lock(mutex_);
  // Runs without the mutex. Nothing is tried after a failure.
  const auto unlocked = [&](auto work) RELMAP_REQUIRES(mutex_) {
    mutex_.unlock();
    const Status status = work();
    mutex_.lock();
    if (!status.ok()) fail(status);
  };
  while (!closing_ || !queue_.empty()) {
    const auto awake = [&]() RELMAP_REQUIRES(mutex_) { return closing_ || !queue_.empty(); };
    if (unsynced)
      changed_.wait_until(mutex_, synced + options_.sync_every, awake);
    else
      changed_.wait(mutex_, awake);
    if (!queue_.empty()) {
      Item item = std::move(queue_.front());
      queue_.pop_front();
      const std::size_t memory = item.memory();
      const bool is_frame = item.head.kind == Kind::kFrame;
      unlocked([&] {
        const Status status = write(item);
        item.body = {};
        return status;
      });
      counts_.waiting -= memory;
      if (!failure_.ok()) counts_.dropped_frames += is_frame;
      unsynced = true;
    }
    if (unsynced && std::chrono::steady_clock::now() >= synced + options_.sync_every) {
      if (failure_.ok()) unlocked([&] { return sync(); });
      synced = std::chrono::steady_clock::now();
      unsynced = false;
    }
  }
  if (failure_.ok()) unlocked([&] { return sync(); });
}

Status RawLogWriter::write(Item& item) {
  std::uint64_t offset = 0;
  {
    const MutexLock lock(mutex_);
    offset = counts_.bytes;
  }
  item.head.bytes = static_cast<std::uint32_t>(item.body.size());
  item.head.crc = crc32c(item.body);
  Status status = file_.append(raw_log::encode_head(item.head));
  if (status.ok()) status = file_.append(item.body);
  if (!status.ok()) {  // no half records
    file_.cut(offset);
    return status;
  }
  const RawLogEntry entry(item.head, offset);
  index_.add(entry);
  const MutexLock lock(mutex_);
  counts_.bytes = entry.end();
  counts_.frames += item.head.kind == Kind::kFrame;
  counts_.events += item.head.kind == Kind::kEvent;
  return {};
}

Status RawLogWriter::sync() {
  if (Status status = file_.sync(); !status.ok()) return status;
  index_.flush();
  return {};
}

void RawLogWriter::fail(const Status& status) {
  if (failure_.ok()) failure_ = status;
  for (const Item& item : queue_) {
    counts_.dropped_frames += item.head.kind == Kind::kFrame;
    counts_.waiting -= item.memory();
  }
  queue_.clear();
}

Status RawLogWriter::close() {
  {
    const MutexLock lock(mutex_);
    if (!closing_ && failure_.ok()) tell_of_dropped();
    closing_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  const MutexLock lock(mutex_);
  return failure_;
}

RawLogCounts RawLogWriter::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

}  // namespace relmap::capture
