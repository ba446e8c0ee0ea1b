#include "frontend/capture/iidc/live_camera.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include "frontend/capture/iidc/embedded_info.h"
#include "frontend/capture/iidc/registers.h"
#include "proto/base/clock.h"
#include "proto/base/mutex.h"

namespace relmap::iidc {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kStopLook{100};                   // between checks of `stop`
constexpr std::chrono::milliseconds kRetry{500}, kMaxRetry{10'000};   // between attempts to open it again
constexpr std::chrono::milliseconds kAppears{50};                     // wait after it was plugged in
constexpr std::chrono::milliseconds kObstacle{1000};                  // obstacles that last less are not reported
constexpr std::chrono::milliseconds kClock{1000}, kMaxClock{60'000};  // between readings of its cycle timer
constexpr std::chrono::milliseconds kClockDoubt{20};                  // an answer that took longer is ignored
constexpr std::chrono::milliseconds kFirst{500};                      // for the first frames after the start
constexpr int kSilentIntervals = 5;                                   // without a frame, at low frame rates
constexpr int kFruitless = 2;  // restarts of the stream before the camera is opened again
constexpr int kBadHeads = 3, kGoodHeads = 10;
constexpr std::int64_t kStep = 1'000'000;  // us

std::int64_t host_us(Clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count();
}

// UTC minus the host's clock, by the tightest of three readings.
std::int64_t utc_of_host() {
  std::int64_t tightest = 0, found = 0;
  for (int i = 0; i < 3; ++i) {
    const std::int64_t before = host_us(Clock::now()), utc = now_us(), spread = host_us(Clock::now()) - before;
    if (i == 0 || spread < tightest) tightest = spread, found = utc - before - spread / 2;
  }
  return found;
}

// Point Grey's cameras: COLOR_FILTER_ID may be missing, or meaningless if the sensor is grey. The byte order is set to
// that of the specification, since another program may have changed it.
Result<std::optional<capture::ColourFilter>> point_grey_filter(const RegisterFile& registers) {
  const Status order = registers.write_kept(pgr::kDataFormat, kOn | 1, 1, "IMAGE_DATA_FORMAT");
  if (order.reason() == Reason::CAMERA_GONE) return order;  // some do not have this register
  const auto tile = registers.read(pgr::kBayerTile);
  if (tile.reason() == Reason::IO_ERROR) return std::optional<capture::ColourFilter>();
  if (!tile.ok()) return tile.status();
  std::string letters;
  for (int shift = 24; shift >= 0; shift -= 8) letters += static_cast<char>(*tile >> shift & 0xff);
  for (const auto& [name, filter] : {std::pair{"YYYY", capture::ColourFilter::kNone},
                                     {"RGGB", capture::ColourFilter::kRGGB},
                                     {"GBRG", capture::ColourFilter::kGBRG},
                                     {"GRBG", capture::ColourFilter::kGRBG},
                                     {"BGGR", capture::ColourFilter::kBGGR}})
    if (letters == name) return std::optional(filter);
  return std::optional<capture::ColourFilter>();
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
  // A camera whose stream another program uses is not touched.
  if (Status status = link_->claim(); !status.ok()) return status;
  registers_.emplace(*link_, rom->command_registers);
  const bool point_grey = rom->vendor_id == pgr::kVendor;
  const auto format = set_stream(*registers_, options_.wish);
  if (!format.ok()) return format.status();
  if (format_.width != 0 && (format->width != format_.width || format->height != format_.height))
    return {Reason::BAD_SIZE, "the camera came back with pictures of another size: " + format->describe()};
  format_ = *format;
  if (point_grey) {
    const auto filter = point_grey_filter(*registers_);
    if (!filter.ok()) return filter.status();
    if (*filter) format_.filter = **filter;
  }
  if (Status status = set_up_exposure(); !status.ok()) return status;
  const auto embeds = point_grey ? embed_info(*registers_) : Result<bool>(false);
  if (!embeds.ok()) return embeds.status();
  embeds_ = *embeds;
  bad_heads_ = good_heads_ = 0;
  cycle_register_.reset();
  clock_ = CycleClock();
  if (embeds_) cycle_register_ = camera_.bus->name() == "usb" ? rom->command_registers + pgr::kCycleTime : kCycleTime;
  if (Status status = link_->start({format_.frame_bytes, format_.image_bytes, options_.buffers}); !status.ok())
    return status;
  last_counter_.reset();
  return begin();
}

// Also sets interval_s_, which depends on the exposure.
Status LiveCamera::set_up_exposure() {
  for (const FeatureSetting& feature : options_.features)
    if (Status status = set_feature(*registers_, feature); !status.ok()) return status;
  if (options_.trigger)
    if (Status status = set_trigger(*registers_, *options_.trigger); !status.ok()) return status;
  for (const StrobeSetting& strobe : options_.strobes)
    if (Status status = set_strobe(*registers_, strobe); !status.ok()) return status;
  const auto trigger = read_feature(*registers_, Feature::kTrigger);
  const auto rate = read_feature(*registers_, Feature::kFrameRate);
  const auto shutter = read_feature(*registers_, Feature::kShutter);
  waits_for_trigger_ = trigger.ok() && trigger->on;
  if (rate.ok() && rate->absolute && rate->on && !rate->automatic && rate->absolute_value > 0)
    format_.rate_hz =
        format_.rate_hz > 0 ? std::min<double>(format_.rate_hz, rate->absolute_value) : rate->absolute_value;
  interval_s_ = format_.rate_hz > 0 ? 1 / format_.rate_hz : 0;
  if (shutter.ok() && shutter->absolute) interval_s_ = std::max<double>(interval_s_, shutter->absolute_value);
  return {};
}

Status LiveCamera::begin() {
  last_frame_ = Clock::now() + kFirst;
  clock_read_ = {};
  clock_pause_ = kClock;
  fresh_ = true;
  return set_sending(*registers_, true);
}

Status LiveCamera::begin_anew() {
  {
    const MutexLock lock(mutex_);
    ++counts_.begun_anew;
  }
  if (Status status = set_sending(*registers_, false); !status.ok()) return status;
  link_->stop();
  if (Status status = link_->start({format_.frame_bytes, format_.image_bytes, options_.buffers}); !status.ok())
    return status;
  return begin();
}

std::optional<std::chrono::milliseconds> LiveCamera::help() {
  const auto patience =
      std::max(options_.silence, std::chrono::milliseconds(std::lround(1000 * kSilentIntervals * interval_s_)));
  if (Clock::now() < last_frame_ + patience) return std::nullopt;
  if (waits_for_trigger_) {  // it may be silent for any time, as long as it is there
    last_frame_ = Clock::now();
    if (registers_->read(reg::kIsoEnable).ok()) return std::nullopt;
  }
  if (++fruitless_ > kFruitless || !begin_anew().ok()) {
    close();
    next_try_ = Clock::now() + std::min(kRetry * fruitless_, kMaxRetry);
  }
  return patience;
}

Status LiveCamera::fault(Status status) {
  const MutexLock lock(mutex_);
  ++counts_.faults[status.reason()];
  return status;
}

LiveCounts LiveCamera::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

// On a bus that is busy with pictures, a reading of the timer may take long; CycleClock weighs it accordingly.
void LiveCamera::read_clock() {
  if (!cycle_register_ || Clock::now() < clock_read_ + clock_pause_) return;
  utc_of_host_us_ = utc_of_host();
  std::uint32_t cycle = 0;
  const auto before = Clock::now();
  const Status status = link_->read(*cycle_register_, {&cycle, 1});
  clock_read_ = Clock::now();
  // Frames must not wait for a register that does not answer.
  if (!status.ok() || !is_cycle_time(cycle)) {
    clock_pause_ = std::min(2 * clock_pause_, kMaxClock);
    return;
  }
  clock_pause_ = kClock;
  // A reading that took so long is useless.
  if (clock_read_ - before > kClockDoubt) return;
  clock_.observe(cycle, host_us(before), host_us(clock_read_));
  const MutexLock lock(mutex_);
  counts_.drift_ppm = clock_.drift_ppm();
}

std::int64_t LiveCamera::time_of(const LiveFrame& frame) const {
  if (!frame.cycle || !clock_.ready()) return frame.raw.arrival_us;
  const std::int64_t time_us = clock_.host_us(*frame.cycle, host_us(frame.arrived)) + utc_of_host_us_;
  // The exposure is before the arrival, and not long before.
  const std::int64_t age_us = frame.raw.arrival_us - time_us;
  return age_us < -10'000 || age_us > 2'000'000 ? frame.raw.arrival_us : time_us;
}

// The frame to return, with `gap` set if frames are missing before it. Nothing if it is not valid; `gap` says why.
std::optional<LiveFrame> LiveCamera::made(RawFrame raw, Status& gap) {
  LiveFrame frame;
  frame.arrived = raw.arrived;
  raw.size = std::min(raw.size, format_.image_bytes);
  std::uint64_t missing = raw.overrun;
  const bool not_taken = missing > 0;
  if (embeds_) {
    const auto info = embedded_info(raw.bytes());
    // The counter may restart with the stream.
    if (!info || (last_counter_ && !fresh_ && !follows(info->counter, *last_counter_))) {
      good_heads_ = 0;
      if (++bad_heads_ < kBadHeads) {
        gap = {Reason::FRAME_DAMAGED, "its first bytes are not those of a frame: the stream is begun anew"};
      } else {
        embeds_ = false;
        cycle_register_.reset();
        gap = {Reason::FRAME_DAMAGED,
               "its stamps are not what this driver takes them for: times are those of arrival from now on"};
      }
      const MutexLock lock(mutex_);
      ++counts_.lost;
      return std::nullopt;
    }
    if (++good_heads_ >= kGoodHeads) bad_heads_ = 0;
    if (last_counter_ && follows(info->counter, *last_counter_))
      missing = std::max<std::uint64_t>(missing, info->counter - *last_counter_ - 1);
    last_counter_ = info->counter;
    frame.cycle = info->cycle;
  }
  index_ += missing;
  frame.index = index_++;
  frame.raw = std::move(raw);
  frame.time_us = time_of(frame);
  // StampFilter must see a step of the host's clock; smaller differences are corrected here.
  if (frame.time_us <= last_time_us_ && last_time_us_ - frame.time_us < kStep) frame.time_us = last_time_us_ + 1;
  last_time_us_ = frame.time_us;
  {
    const MutexLock lock(mutex_);
    ++counts_.frames;
    counts_.lost += missing;
  }
  // The report of a restart or a halt covers all frames that were lost until the stream went on.
  const bool all_told = std::exchange(halted_, false) || fresh_;
  if (missing > std::exchange(told_, 0) && !all_told)
    gap = {Reason::CAPTURE_FAILED, std::to_string(missing) + " frames before frame " + std::to_string(frame.index) +
                                       (not_taken ? " were not taken in time" : " did not come")};
  fresh_ = false;
  return frame;
}

std::optional<Status> LiveCamera::come_back() {
  while (!stop_) {
    const auto now = Clock::now();
    if (now < next_try_) {
      const auto wait = std::min(kStopLook, std::chrono::ceil<std::chrono::milliseconds>(next_try_ - now));
      // The device's file appears, and becomes accessible, a little after the device.
      if (camera_.bus->wait_for_change(wait)) next_try_ = std::min(next_try_, Clock::now() + kAppears);
      continue;
    }
    next_try_ = now + kRetry;
    auto link = reopen(buses_, camera_.address.guid);
    Status status = link.status();
    if (link.ok()) {
      link_ = std::move(*link);
      status = set_up();
      if (status.ok()) {
        const MutexLock lock(mutex_);
        ++counts_.reopened;
        obstacle_ = Reason::OK;
        return std::nullopt;
      }
      close();
    }
    if (status.reason() == Reason::NO_CAMERA || status.reason() == Reason::CAMERA_GONE) continue;
    if (std::exchange(obstacle_, status.reason()) != status.reason()) {
      obstacle_since_ = now;
      obstacle_told_ = false;
    }
    if (!obstacle_told_ && now >= obstacle_since_ + kObstacle) {
      obstacle_told_ = true;
      return fault(status);
    }
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
    auto raw = link_->next(kStopLook);
    if (raw.ok()) {
      Status gap;
      auto frame = made(std::move(*raw), gap);
      if (frame) {
        last_frame_ = Clock::now();
        fruitless_ = 0;
      }
      if (gap.ok()) return frame;
      kept_ = std::move(frame);
      if (!kept_ && !begin_anew().ok()) close();
      return fault(gap);
    }
    Status status = raw.status();
    if (status.reason() == Reason::CAMERA_GONE) {
      close();
      next_try_ = Clock::now() + kStopLook;
      return fault({Reason::CAMERA_GONE, status.message() + "; waiting for it"});
    }
    const bool silent = status.reason() == Reason::CAMERA_SILENT;
    if (!silent) {
      ++told_;
      halted_ |= status.reason() == Reason::CAMERA_STALLED;
      if (!embeds_) {  // otherwise its counter shows the gap
        ++index_;
        const MutexLock lock(mutex_);
        ++counts_.lost;
      }
    }
    const auto waited = help();
    if (!silent) return fault(std::move(status));
    if (!waited) continue;
    return fault({Reason::CAMERA_SILENT, "no frame for " + std::to_string(waited->count()) + " ms; " +
                                             (link_ ? "the stream was begun anew" : "the camera is opened anew")});
  }
  return std::optional<LiveFrame>();
}

}  // namespace relmap::iidc
