#include "frontend/capture/dc1394/dc1394_link.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "proto/base/mutex.h"

namespace relmap::iidc::dc1394 {

namespace {

constexpr std::size_t kMaxArrivals = 512;  // bounds faults that are not taken

}  // namespace

Status Dc1394Link::open(const std::string& program, const std::vector<std::string>& arguments, std::uint64_t guid) {
  return open(CameraProcess::start(program, arguments, *this), guid);
}

Status Dc1394Link::open_at(FileHandle socket, std::uint64_t guid) {
  return open(CameraProcess::at(std::move(socket), std::nullopt, *this), guid);
}

Status Dc1394Link::open(Result<std::unique_ptr<CameraProcess>> process, std::uint64_t guid) {
  if (!process.ok()) return process.status();
  process_ = std::move(*process);
  Request request;
  request.ask = Ask::kOpen;
  request.subject = guid;
  const auto answer = process_->ask(request);
  if (!answer.ok()) return answer.status();
  place_ = answer->text.data();
  return {};
}

Status Dc1394Link::read(std::uint64_t address, std::span<std::uint32_t> quadlets) {
  for (std::size_t at = 0; at < quadlets.size(); at += kMaxQuadlets) {
    const std::span<std::uint32_t> part = quadlets.subspan(at, std::min(kMaxQuadlets, quadlets.size() - at));
    Request request;
    request.ask = Ask::kRead;
    request.subject = address + 4 * at;
    request.count = static_cast<std::uint32_t>(part.size());
    const auto answer = process_->ask(request);
    if (!answer.ok()) return answer.status();
    if (answer->count != part.size()) return {Reason::IO_ERROR, "another number of registers came than was asked for"};
    std::transform(answer->values.begin(), answer->values.begin() + answer->count, part.begin(),
                   [](std::uint64_t value) { return static_cast<std::uint32_t>(value); });
  }
  return {};
}

Status Dc1394Link::write(std::uint64_t address, std::uint32_t quadlet) {
  Request request;
  request.ask = Ask::kWrite;
  request.subject = address;
  request.amount = quadlet;
  return process_->ask(request).status();
}

Status Dc1394Link::start(const StreamRequest& request) {
  const std::size_t slots = std::max<std::size_t>(3, request.buffers);
  auto ring = FrameRing::make(slots, request.frame_bytes);
  if (!ring.ok()) return {Reason::BUDGET_EXCEEDED, ring.status().message()};
  {
    const MutexLock lock(mutex_);
    if (ring_) return {Reason::WRONG_STATE, "the camera's stream is received already"};
    ring_ = *ring;  // frames may come before the answer
    image_bytes_ = request.image_bytes;
  }
  Request start;
  start.ask = Ask::kStart;
  start.subject = request.image_bytes;
  start.amount = request.frame_bytes;
  start.count = static_cast<std::uint32_t>(slots);
  const Status status = process_->ask(start, (*ring)->file()).status();
  if (!status.ok()) stop();
  return status;
}

void Dc1394Link::stop() {
  {
    const MutexLock lock(mutex_);
    if (!ring_) return;
  }
  Request request;
  request.ask = Ask::kStop;
  (void)process_->ask(request);  // whose frames all came before its answer; where it has ended, none come
  std::deque<Arrival> dropped;
  const MutexLock lock(mutex_);
  ring_.reset();
  arrivals_.swap(dropped);
  overrun_ = 0;
}

Status Dc1394Link::told(const Message& message) {
  const MutexLock lock(mutex_);
  news_.notify_all();
  if (message.tell == Tell::kFrame) return queue_frame(message);
  if (message.reason == Reason::CAMERA_GONE)
    gone_ = message.status();
  else if (arrivals_.size() < kMaxArrivals)
    arrivals_.push_back({message.status(), {}});
  return {};
}

Status Dc1394Link::queue_frame(const Message& message) {
  if (!ring_) return {Reason::CORRUPT, "a frame that nobody waits for"};
  const auto& [slot, bytes, arrival_us, overrun] =
      std::tuple(message.values[0], message.values[1], message.values[2], message.values[3]);
  if (bytes < image_bytes_ || bytes > ring_->frame_bytes())
    return {Reason::CORRUPT, "a frame of " + std::to_string(bytes) + " bytes"};
  auto data = slot < ring_->slots() ? ring_->lend(static_cast<std::uint32_t>(slot)) : nullptr;
  if (!data) return {Reason::CORRUPT, "a frame in slot " + std::to_string(slot) + ", which it has not"};
  arrivals_.push_back({Status(),
                       {std::move(data), static_cast<std::size_t>(bytes), static_cast<std::int64_t>(arrival_us),
                        std::chrono::steady_clock::now(), std::exchange(overrun_, 0) + overrun}});
  if (ring_->all_lent()) drop_oldest();
  return {};
}

// Drops a frame that was not taken, to make room. The frame after it states the loss (RawFrame::overrun).
void Dc1394Link::drop_oldest() {
  const auto is_frame = [](const Arrival& arrival) { return arrival.status.ok(); };
  const auto oldest = std::find_if(arrivals_.begin(), arrivals_.end(), is_frame);
  const std::uint64_t lost = oldest->frame.overrun + 1;
  const auto heir = std::find_if(arrivals_.erase(oldest), arrivals_.end(), is_frame);
  (heir != arrivals_.end() ? heir->frame.overrun : overrun_) += lost;
}

void Dc1394Link::ended(const Status& why) {
  pause_->crashed(why);
  const MutexLock lock(mutex_);
  gone_ = why;
  news_.notify_all();
}

Result<RawFrame> Dc1394Link::next(std::chrono::milliseconds wait) {
  MutexLock lock(mutex_);
  if (!ring_) return {Reason::WRONG_STATE, "the camera's stream is not received"};
  news_.wait_for(mutex_, wait, [this]() RELMAP_REQUIRES(mutex_) { return !arrivals_.empty() || !gone_.ok(); });
  if (arrivals_.empty() && gone_.ok())
    return {Reason::CAMERA_SILENT, "no frame within " + std::to_string(wait.count()) + " ms"};
  if (arrivals_.empty()) return gone_;
  Arrival arrival = std::move(arrivals_.front());
  arrivals_.pop_front();
  if (!arrival.status.ok()) return arrival.status;
  return std::move(arrival.frame);
}

}  // namespace relmap::iidc::dc1394
