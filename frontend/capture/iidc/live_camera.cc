#include "frontend/capture/iidc/live_camera.h"

#include <algorithm>
#include <string>
#include <thread>
#include <utility>

#include "frontend/capture/iidc/embedded_info.h"
#include "frontend/capture/iidc/registers.h"
#include "proto/clock.h"

namespace relmap::iidc {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{100};                          // between looks at `stop`
constexpr std::chrono::milliseconds kRetry{500};                         // between attempts to have it back
constexpr std::chrono::milliseconds kClock{1000}, kClockAtMost{60'000};  // between readings of its cycle timer
constexpr std::chrono::milliseconds kFirst{500};                         // for the first frames after it was let send
constexpr int kSilentIntervals = 5;                                      // of a slow rate, until it counts as silent

std::int64_t host_us(Clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count();
}

}  // namespace

Result<std::unique_ptr<LiveCamera>> LiveCamera::open(std::vector<std::shared_ptr<CameraBus>> buses,
                                                     const LiveOptions& options, const std::atomic<bool>& stop) {
  std::unique_ptr<LiveCamera> live(new LiveCamera(std::move(buses), options, stop));
  auto camera = choose_camera(live->buses_, options.serial);
  if (!camera.ok()) return camera.status();
  live->camera_ = std::move(*camera);
  auto link = live->camera_.bus->open(live->camera_.address.guid);
  if (!link.ok()) return link.status();
  live->link_ = std::move(*link);
  if (Status status = live->set_up(); !status.ok()) return status;
  return live;
}

LiveCamera::~LiveCamera() { close(); }

void LiveCamera::close() {
  if (registers_) (void)set_sending(*registers_, false);  // it may have gone
  if (link_) link_->stop();
  registers_.reset();
  link_.reset();
}

Status LiveCamera::set_up() {
  CameraAddress address = camera_.address;
  const auto rom = identify(*link_, address);
  if (!rom) return address.usable;
  registers_.emplace(*link_, rom->command_registers);
  const auto format = set_stream(*registers_, options_.wish);
  if (!format.ok()) return format.status();
  if (format_.width != 0 && (format->width != format_.width || format->height != format_.height))
    return {Reason::BAD_SIZE, "the camera came back with pictures of another size: " + format->describe()};
  format_ = *format;
  for (const FeatureSetting& feature : options_.features)
    if (Status status = set_feature(*registers_, feature); !status.ok()) return status;
  if (options_.trigger)
    if (Status status = set_trigger(*registers_, *options_.trigger); !status.ok()) return status;
  const bool point_grey = rom->vendor_id == pgr::kVendor;
  const auto embeds = point_grey ? embed_info(*registers_) : Result<bool>(false);
  if (!embeds.ok()) return embeds.status();
  embeds_ = *embeds;
  cycle_register_.reset();
  if (embeds_) cycle_register_ = camera_.bus->name() == "usb" ? rom->command_registers + pgr::kCycleTime : kCycleTime;
  if (Status status = link_->start({format_.frame_bytes, format_.image_bytes, options_.buffers}); !status.ok())
    return status;
  return begin();
}

Status LiveCamera::begin() {
  last_counter_.reset();
  last_frame_ = Clock::now() + kFirst;
  clock_read_ = {};
  clock_pause_ = kClock;
  return set_sending(*registers_, true);
}

Status LiveCamera::begin_anew() {
  {
    const std::lock_guard lock(mutex_);
    ++counts_.begun_anew;
  }
  if (Status status = set_sending(*registers_, false); !status.ok()) return status;
  link_->stop();
  if (Status status = link_->start({format_.frame_bytes, format_.image_bytes, options_.buffers}); !status.ok())
    return status;
  return begin();
}

Status LiveCamera::fault(Status status) {
  const std::lock_guard lock(mutex_);
  ++counts_.faults[status.reason()];
  return status;
}

LiveCounts LiveCamera::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

// The reading of a timer over a bus that is busy with pictures may take a while: it says so by itself.
void LiveCamera::read_clock() {
  if (!cycle_register_ || Clock::now() < clock_read_ + clock_pause_) return;
  std::uint32_t cycle = 0;
  const auto before = Clock::now();
  const Status status = link_->read(*cycle_register_, {&cycle, 1});
  clock_read_ = Clock::now();
  // Frames must not wait for a register that does not answer.
  if (!status.ok() || !is_cycle_time(cycle)) {
    clock_pause_ = std::min(2 * clock_pause_, kClockAtMost);
    return;
  }
  clock_pause_ = kClock;
  clock_.observe(cycle, host_us(before), host_us(clock_read_));
  const std::lock_guard lock(mutex_);
  counts_.drift_ppm = clock_.drift_ppm();
}

std::int64_t LiveCamera::time_of(const LiveFrame& frame) const {
  if (!frame.cycle || !clock_.ready()) return frame.raw.arrival_us;
  const std::int64_t utc_of_host = now_us() - host_us(Clock::now());
  const std::int64_t time_us = clock_.host_us(*frame.cycle, host_us(frame.arrived)) + utc_of_host;
  // A frame is exposed before it comes, and not long before.
  const std::int64_t age_us = frame.raw.arrival_us - time_us;
  return age_us < -10'000 || age_us > 2'000'000 ? frame.raw.arrival_us : time_us;
}

// A frame as it is given out; `gap`: what is missing before it. Nothing: it is no frame, as `gap` says.
std::optional<LiveFrame> LiveCamera::made(RawFrame raw, Status& gap) {
  LiveFrame frame;
  frame.arrived = Clock::now();
  raw.size = std::min(raw.size, format_.image_bytes);
  std::uint64_t missing = raw.overrun;
  const bool not_taken = missing > 0;
  if (embeds_) {
    const auto info = embedded_info(raw.bytes());
    if (!info || (last_counter_ && !follows(info->counter, *last_counter_))) {
      gap = {Reason::FRAME_DAMAGED, "its first bytes are not those of a frame: the stream is begun anew"};
      const std::lock_guard lock(mutex_);
      ++counts_.lost;
      return std::nullopt;
    }
    if (last_counter_) missing = std::max<std::uint64_t>(missing, info->counter - *last_counter_ - 1);
    last_counter_ = info->counter;
    frame.cycle = info->cycle;
  }
  index_ += missing;
  frame.index = index_++;
  frame.raw = std::move(raw);
  frame.time_us = time_of(frame);
  {
    const std::lock_guard lock(mutex_);
    ++counts_.frames;
    counts_.lost += missing;
  }
  if (missing > std::exchange(told_, 0))
    gap = {Reason::CAPTURE_FAILED, std::to_string(missing) + " frames before frame " + std::to_string(frame.index) +
                                       (not_taken ? " were not taken in time" : " did not come")};
  return frame;
}

std::optional<Status> LiveCamera::come_back() {
  while (!stop_) {
    const auto now = Clock::now();
    if (now < next_try_) {
      camera_.bus->wait_for_change(std::min(kLook, std::chrono::ceil<std::chrono::milliseconds>(next_try_ - now)));
      // What was plugged in is looked at soon, though its device file may come a little later.
      continue;
    }
    next_try_ = now + kRetry;
    auto link = reopen(buses_, camera_.address.guid);
    Status status = link.status();
    if (link.ok()) {
      link_ = std::move(*link);
      status = set_up();
      if (status.ok()) {
        const std::lock_guard lock(mutex_);
        ++counts_.reopened;
        obstacle_ = Reason::OK;
        return std::nullopt;
      }
      close();
    }
    if (status.reason() == Reason::NO_CAMERA || status.reason() == Reason::CAMERA_GONE) continue;
    if (std::exchange(obstacle_, status.reason()) != status.reason()) return fault(status);
  }
  return std::nullopt;
}

Result<std::optional<LiveFrame>> LiveCamera::next() {
  if (kept_) return std::exchange(kept_, std::nullopt);
  while (!stop_) {
    if (!link_) {
      if (auto obstacle = come_back()) return *std::move(obstacle);
      continue;
    }
    read_clock();
    auto raw = link_->next(kLook);
    if (raw.ok()) {
      last_frame_ = Clock::now();
      Status gap;
      auto frame = made(std::move(*raw), gap);
      if (gap.ok()) return frame;
      kept_ = std::move(frame);
      if (!kept_)
        if (Status status = begin_anew(); !status.ok()) close();
      return fault(gap);
    }
    Status status = raw.status();
    if (status.reason() == Reason::CAMERA_GONE) {
      close();
      next_try_ = Clock::now() + kLook;
      return fault({Reason::CAMERA_GONE, status.message() + "; it is waited for"});
    }
    if (status.reason() != Reason::CAMERA_SILENT) {
      last_frame_ = Clock::now();
      ++told_;
      if (!embeds_) {  // else its counter tells
        ++index_;
        const std::lock_guard lock(mutex_);
        ++counts_.lost;
      }
      return fault(std::move(status));
    }
    const double interval_ms = format_.rate_hz > 0 ? 1000 / format_.rate_hz : 0;
    const auto patience =
        std::max(options_.silence, std::chrono::milliseconds(static_cast<long>(kSilentIntervals * interval_ms)));
    // One that waits for a trigger may be silent as long as it likes.
    if (options_.trigger && options_.trigger->on) continue;
    if (Clock::now() < last_frame_ + patience) continue;
    if (Status again = begin_anew(); !again.ok()) {
      close();
      next_try_ = Clock::now() + kLook;
      return fault(again.reason() == Reason::CAMERA_GONE
                       ? again
                       : Status(Reason::CAMERA_GONE, "it answers no more (" + again.message() + ")"));
    }
    return fault(
        {Reason::CAMERA_SILENT, "no frame for " + std::to_string(patience.count()) + " ms; the stream was begun anew"});
  }
  return std::optional<LiveFrame>();
}

}  // namespace relmap::iidc
