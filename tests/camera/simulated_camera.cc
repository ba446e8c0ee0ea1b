#include "tests/camera/simulated_camera.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "frontend/capture/iidc/registers.h"
#include "tests/camera/config_rom.h"

namespace relmap::testing {

namespace {

namespace reg = iidc::reg;

constexpr std::size_t kUsbPacket = 512;

std::vector<std::uint32_t> make_rom(const SimulatedCameraOptions& options) {
  return ConfigRom{options.guid, options.vendor, options.model, SimulatedCamera::kCommandRegisters}.quadlets();
}

}  // namespace

SimulatedCamera::SimulatedCamera(SimulatedCameraOptions options)
    : options_(std::move(options)), rom_(make_rom(options_)) {
  restart();
}

void SimulatedCamera::restart() {
  const std::lock_guard lock(mutex_);
  power_on_ = previous_start_ = can_start_ = Clock::now();
  next_number_ = 0;
  factory_settings();
}

SimulatedCamera::Answer SimulatedCamera::read(std::uint64_t address, std::uint32_t& quadlet) {
  const std::lock_guard lock(mutex_);
  if (faults_.mute_registers.contains(address)) return Answer::kNone;
  if (address % 4 != 0 || address < iidc::kRegisterSpace) return Answer::kRefused;
  if (const std::uint64_t place = (address - iidc::kConfigRom) / 4;
      address >= iidc::kConfigRom && place < rom_.size()) {
    const bool unit_directory = rom_[place] >> 24 == 0xd1;
    quadlet = rom_[place] ^ (faults_.bad_rom && unit_directory ? 0x0040'0000u : 0u);
    return Answer::kDone;
  }
  const auto offset = static_cast<std::uint32_t>(address - iidc::kRegisterSpace);
  if (address == iidc::kCycleTime || offset == kCommandRegisters + iidc::pgr::kCycleTime) {
    quadlet = cycle_time(Clock::now());
    return Answer::kDone;
  }
  const auto found = registers_.find(offset);
  if (found == registers_.end()) return Answer::kRefused;
  quadlet = found->second.value;
  return Answer::kDone;
}

SimulatedCamera::Answer SimulatedCamera::write(std::uint64_t address, std::uint32_t quadlet) {
  std::function<void()> changed;
  {
    const std::lock_guard lock(mutex_);
    if (faults_.mute_registers.contains(address)) return Answer::kNone;
    if (address % 4 != 0 || address < iidc::kRegisterSpace) return Answer::kRefused;
    const auto offset = static_cast<std::uint32_t>(address - iidc::kRegisterSpace);
    const auto found = registers_.find(offset);
    if (found == registers_.end()) return Answer::kRefused;
    if (faults_.forgetful_registers.contains(address)) return Answer::kDone;
    Register& target = found->second;
    const std::uint32_t before = target.value;
    target.value = (before & ~target.writable) | (quadlet & target.writable);
    written(offset, before);
    changed = on_change_;
  }
  if (changed) changed();
  return Answer::kDone;
}

std::uint32_t SimulatedCamera::command_register(std::uint32_t offset) {
  std::uint32_t quadlet = 0;
  if (read(iidc::kRegisterSpace + kCommandRegisters + offset, quadlet) != Answer::kDone)
    throw std::out_of_range("no register " + std::to_string(offset));
  return quadlet;
}

std::optional<SimulatedCamera::Clock::time_point> SimulatedCamera::next_start() const {
  const std::lock_guard lock(mutex_);
  if (!to_send()) return std::nullopt;
  return std::max(previous_start_ + period(*picture()), can_start_);
}

std::optional<SimulatedCamera::Frame> SimulatedCamera::take_frame(Clock::time_point now) {
  Frame frame;
  Picture shape;
  CameraFaults wrong;
  bool silent;
  {
    const std::lock_guard lock(mutex_);
    if (!to_send()) return std::nullopt;
    shape = *picture();
    const Clock::duration step = period(shape);
    frame.start = std::max(previous_start_ + step, can_start_);
    if (frame.start > now) return std::nullopt;
    if (now - frame.start > step) frame.start += (now - frame.start) / step * step;  // the simulator was late
    previous_start_ = frame.start;
    frame.end = frame.start + std::min<Clock::duration>(shape.bus_time(), step);
    frame.number = next_number_++;
    at(kCommandRegisters + reg::kOneShot) = 0;
    at(kCommandRegisters + reg::kSoftwareTrigger) = 0;
    edge_ = false;
    wrong = faults_;
    silent = frame.start < silent_until_;
    for (int* count :
         {&faults_.short_frames, &faults_.long_frames, &faults_.torn_frames, &faults_.shifted_frames, &faults_.stalls})
      *count = std::max(0, *count - 1);
  }
  frame.stalls = wrong.stalls > 0;
  if (frame.stalls) return frame;
  if (silent) return frame;  // counted, and nothing sent
  make_content(frame.number, shape, frame.bytes);
  if (wrong.torn_frames > 0) {
    std::vector<std::uint8_t> next;
    make_content(frame.number + 1, shape, next);
    const auto half = static_cast<std::ptrdiff_t>(frame.bytes.size() / 2);
    std::copy(next.begin() + half, next.end(), frame.bytes.begin() + half);
  }
  if (wrong.dead_eye && shape.bytes_per_pixel == 2)
    for (std::size_t i = *wrong.dead_eye == capture::FirstByte::kRight ? 0 : 1; i < frame.bytes.size(); i += 2)
      frame.bytes[i] = 0;
  embed(frame.number, frame.start, frame.bytes);
  frame.bytes.resize(std::size_t{shape.packets()} * shape.packet_bytes);
  if (wrong.short_frames > 0) frame.bytes.resize(frame.bytes.size() / 2);
  if (wrong.long_frames > 0) frame.bytes.resize(frame.bytes.size() + 1000);
  if (wrong.shifted_frames > 0) {
    const auto from =
        frame.bytes.begin() + static_cast<std::ptrdiff_t>(frame.bytes.size() / 2 / kUsbPacket * kUsbPacket);
    frame.bytes.erase(from, from + 2 * kUsbPacket);
    frame.ends = false;
  }
  return frame;
}

void SimulatedCamera::make_content(std::uint64_t number, const Picture& shape, std::vector<std::uint8_t>& bytes) const {
  bytes.resize(shape.bytes());
  if (!options_.content) return default_frame(number, bytes);
  if (shape.bytes_per_pixel == 2) return options_.content(number, bytes);
  std::vector<std::uint8_t> both(2 * bytes.size());
  options_.content(number, both);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = both[2 * i];
}

// In the order of the bits, from the lowest; what this camera cannot tell is 0.
void SimulatedCamera::embed(std::uint64_t number, Clock::time_point time, std::vector<std::uint8_t>& bytes) const {
  const std::lock_guard lock(mutex_);
  const std::uint32_t wanted = at(kCommandRegisters + iidc::pgr::kFrameInfo);
  std::size_t place = 0;
  for (std::uint32_t what = iidc::pgr::kStamp; what <= iidc::pgr::kRoi; what <<= 1) {
    if (!(wanted & what)) continue;
    std::uint32_t value = 0;
    if (what == iidc::pgr::kStamp) value = cycle_time(time);
    if (what == iidc::pgr::kFrameCounter) value = static_cast<std::uint32_t>(number);
    if (what == iidc::pgr::kShutter) value = at(kCommandRegisters + reg::kFeature + 4 * 7);
    if (what == iidc::pgr::kGain) value = at(kCommandRegisters + reg::kFeature + 4 * 8);
    for (int shift = 24; shift >= 0; shift -= 8) bytes[place++] = static_cast<std::uint8_t>(value >> shift);
  }
}

std::uint32_t SimulatedCamera::cycle_time(Clock::time_point at) const {
  const double real = std::chrono::duration<double>(at - power_on_).count();
  const auto parts = static_cast<std::uint64_t>(real * (1 + options_.clock_drift_ppm * 1e-6) * 8000 * 3072);
  const std::uint64_t cycles = parts / 3072;
  return static_cast<std::uint32_t>((cycles / 8000 % 128) << 25 | (cycles % 8000) << 12 | parts % 3072);
}

void SimulatedCamera::fail(const std::function<void(CameraFaults&)>& change) {
  std::function<void()> changed;
  {
    const std::lock_guard lock(mutex_);
    change(faults_);
    if (faults_.silence.count() > 0) silent_until_ = Clock::now() + std::exchange(faults_.silence, {});
    changed = on_change_;
  }
  if (changed) changed();
}

CameraFaults SimulatedCamera::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

void SimulatedCamera::trigger() {
  std::function<void()> changed;
  {
    const std::lock_guard lock(mutex_);
    edge_ = true;
    can_start_ = Clock::now();
    changed = on_change_;
  }
  if (changed) changed();
}

void SimulatedCamera::on_change(std::function<void()> call) {
  const std::lock_guard lock(mutex_);
  on_change_ = std::move(call);
}

}  // namespace relmap::testing
