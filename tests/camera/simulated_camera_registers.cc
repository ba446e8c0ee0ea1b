// The registers of a SimulatedCamera: what it begins with, what a write brings about, and what follows for its frames.
#include <algorithm>
#include <bit>
#include <cmath>

#include "frontend/capture/iidc/registers.h"
#include "tests/camera/simulated_camera.h"

namespace relmap::testing {

namespace {

namespace reg = iidc::reg;
namespace format7 = iidc::format7;
namespace control = iidc::control;
namespace inquiry = iidc::inquiry;

constexpr std::uint32_t kBase = SimulatedCamera::kCommandRegisters;
constexpr std::uint32_t kFormat7 = kBase + 0x2000, kFormat7Size = 0x100;
constexpr std::uint32_t kAbsolute = kBase + 0x3000, kAbsoluteSize = 0x10;
constexpr std::uint32_t kStrobe = kBase + 0x4000;
constexpr std::uint32_t kAll = 0xffff'ffff;
constexpr std::uint32_t kVideoModeError = 0x628;
constexpr std::uint32_t kPacketUnit = 8, kMaxPacket = 4096;  // bytes, at 400 Mbit/s
constexpr std::chrono::nanoseconds kCycle{125'000};

struct Feature {
  std::uint32_t number;  // of its registers
  std::uint32_t min, max, value;
  std::uint32_t abilities;
  float absolute_min, absolute_max;
};

// The frame rate's absolute value ends at the camera's rate.
const Feature kFeatures[] = {
    {0, 0, 255, 64, inquiry::kReadOut | inquiry::kManual, 0, 0},  // brightness
    {1, 1, 1023, 400, inquiry::kReadOut | inquiry::kOnOff | inquiry::kAuto | inquiry::kManual, 0, 0},
    {7, 1, 1000, 300, inquiry::kAbsolute | inquiry::kReadOut | inquiry::kAuto | inquiry::kManual, 2e-5f, 0.06f},
    {8, 16, 640, 16, inquiry::kAbsolute | inquiry::kReadOut | inquiry::kAuto | inquiry::kManual, 0, 24},
    {15, 1, 3000, 3000, inquiry::kAbsolute | inquiry::kReadOut | inquiry::kOnOff | inquiry::kAuto | inquiry::kManual, 1,
     0},
};
constexpr std::uint32_t kTrigger = 12, kFrameRate = 15;
constexpr std::uint32_t kTriggerAbilities =  // sources 0 and software, modes 0 and 1
    inquiry::kPresent | inquiry::kReadOut | inquiry::kOnOff | 0x0200'0000 | 0x0080'0000 | 0x0001'0000 | 0xc000;
constexpr std::uint32_t kSoftwareSource = 7;

const Feature* feature_of(std::uint32_t number) {
  for (const Feature& feature : kFeatures)
    if (feature.number == number) return &feature;
  return nullptr;
}

std::uint32_t bit(int number) { return 0x8000'0000u >> number; }
std::uint32_t offset_quadlets(std::uint32_t offset) { return offset / 4; }

std::uint32_t letters(const std::string& text) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | (i < text.size() ? static_cast<unsigned char>(text[i]) : 0u);
  return value;
}

std::optional<std::uint32_t> colour_filter(const std::string& tile) {
  const char* const kNames[] = {"RGGB", "GBRG", "GRBG", "BGGR"};
  for (std::uint32_t i = 0; i < 4; ++i)
    if (tile == kNames[i]) return i;
  return std::nullopt;
}

// Formats 0 and 2: what they offer.
struct FixedMode {
  std::uint32_t format, mode;
  int width, height, bytes_per_pixel;
};
constexpr FixedMode kFixedModes[] = {
    {0, 5, 640, 480, 1}, {0, 6, 640, 480, 2}, {2, 2, 1280, 960, 1}, {2, 6, 1280, 960, 2}};
constexpr double kSlowestRate = 1.875;  // of rate 0; each next is twice as fast
constexpr int kFirstRate = 2, kLastRate = 4;

}  // namespace

std::size_t SimulatedCamera::Picture::bytes() const {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(bytes_per_pixel);
}

std::uint32_t SimulatedCamera::Picture::packets() const {
  return static_cast<std::uint32_t>((bytes() + packet_bytes - 1) / packet_bytes);
}

SimulatedCamera::Clock::duration SimulatedCamera::Picture::bus_time() const { return packets() * kCycle; }

void SimulatedCamera::factory_settings() {
  registers_.clear();
  edge_ = false;
  const auto fixed = [&](std::uint32_t offset, std::uint32_t value) { registers_[kBase + offset] = {value, 0}; };
  const auto free = [&](std::uint32_t offset, std::uint32_t value, std::uint32_t writable) {
    registers_[kBase + offset] = {value, writable};
  };
  free(reg::kInitialize, 0, bit(0));
  fixed(reg::kFormatInq, bit(0) | bit(2) | bit(7));
  for (const FixedMode& mode : kFixedModes) {
    registers_[kBase + reg::kModeInq + 4 * mode.format].value |= bit(static_cast<int>(mode.mode));
    for (int rate = kFirstRate; rate <= kLastRate; ++rate)
      registers_[kBase + reg::kRateInq + 0x20 * mode.format + 4 * mode.mode].value |= bit(rate);
  }
  fixed(reg::kModeInq + 4 * 7, bit(0) | bit(3));
  // Advanced features, errors of video modes, optional functions, power, one shot.
  fixed(reg::kBasicFuncInq, bit(0) | bit(1) | bit(3) | bit(16) | bit(19));
  fixed(reg::kOptFunctionInq, bit(3));
  fixed(reg::kAdvFeatureInq, offset_quadlets(kBase + 0x1000));
  fixed(reg::kStrobeCsrInq, offset_quadlets(kStrobe));
  free(reg::kCurrentRate, 3u << 29, 7u << 29);
  free(reg::kCurrentMode, 5u << 29, 7u << 29);
  free(reg::kCurrentFormat, 0, 7u << 29);
  free(reg::kIsoChannel, 2u << 24, 0xff00'0000);
  free(reg::kCameraPower, bit(0), bit(0));
  free(reg::kIsoEnable, 0, bit(0));
  free(reg::kOneShot, 0, bit(0));
  fixed(kVideoModeError, 0);
  free(reg::kSoftwareTrigger, 0, bit(0));
  fixed(reg::kDataDepth, 8u << 24);
  add_features();
  add_format7(0, 1, bit(0), 0);
  add_format7(3, 2, bit(5) | bit(10), 10);
  for (const std::uint32_t quadlet : {0u, 4u, 8u, 12u}) {
    registers_[kStrobe + 0x100 + quadlet] = {bit(0) | bit(4) | bit(5) | bit(6) | 0xfff, 0};
    registers_[kStrobe + 0x200 + quadlet] = {bit(0), 0x03ff'ffff};
  }
  registers_[kStrobe] = {0xf000'0000, 0};
  fixed(iidc::pgr::kSerialNumber, options_.serial);
  fixed(iidc::pgr::kBayerTile, letters(options_.bayer_tile));
  free(iidc::pgr::kDataFormat, bit(0), 1);
  free(iidc::pgr::kFrameInfo, bit(0), 0x3ff);
}

void SimulatedCamera::add_features() {
  registers_[kBase + reg::kFeatureLoInq] = {0, 0};
  registers_[kBase + reg::kFeatureHiInq] = {bit(kTrigger), 0};
  for (std::uint32_t number = 0; number < 16; ++number) {  // those not there read as 0
    registers_[kBase + reg::kElementInq + 4 * number] = {0, 0};
    registers_[kBase + reg::kFeature + 4 * number] = {0, 0};
    registers_[kBase + reg::kAbsoluteCsrInq + 4 * number] = {0, 0};
  }
  for (const Feature& feature : kFeatures) {
    const std::uint32_t number = feature.number;
    at(kBase + reg::kFeatureHiInq) |= bit(static_cast<int>(number));
    at(kBase + reg::kElementInq + 4 * number) =
        inquiry::kPresent | feature.abilities | feature.min << inquiry::kMinShift | feature.max;
    std::uint32_t writable = control::kValue;
    if (feature.abilities & inquiry::kAbsolute) writable |= control::kAbsolute;
    if (feature.abilities & inquiry::kOnOff) writable |= control::kOn;
    if (feature.abilities & inquiry::kAuto) writable |= control::kAuto;
    const std::uint32_t automatic = feature.abilities & inquiry::kAuto ? control::kAuto : 0;
    registers_[kBase + reg::kFeature + 4 * number] = {control::kPresent | control::kOn | automatic | feature.value,
                                                      writable};
    if (!(feature.abilities & inquiry::kAbsolute)) continue;
    const std::uint32_t csr = kAbsolute + kAbsoluteSize * number;
    at(kBase + reg::kAbsoluteCsrInq + 4 * number) = offset_quadlets(csr);
    const float max = number == kFrameRate ? static_cast<float>(options_.rate) : feature.absolute_max;
    registers_[csr + iidc::absolute::kMin] = {std::bit_cast<std::uint32_t>(feature.absolute_min), 0};
    registers_[csr + iidc::absolute::kMax] = {std::bit_cast<std::uint32_t>(max), 0};
    registers_[csr + iidc::absolute::kValue] = {0, kAll};
    written_feature(kBase + reg::kFeature + 4 * number, at(kBase + reg::kFeature + 4 * number));
  }
  at(kBase + reg::kElementInq + 4 * kTrigger) = kTriggerAbilities;
  registers_[kBase + reg::kFeature + 4 * kTrigger] = {control::kPresent, 0x03ef'0fff};
}

void SimulatedCamera::add_format7(int mode, int bytes_per_pixel, std::uint32_t codings, std::uint32_t coding) {
  const std::uint32_t csr = kFormat7 + kFormat7Size * static_cast<std::uint32_t>(mode);
  registers_[kBase + reg::kFormat7CsrInq + 4 * static_cast<std::uint32_t>(mode)] = {offset_quadlets(csr), 0};
  bytes_per_pixel_[csr] = bytes_per_pixel;
  const std::uint32_t size =
      static_cast<std::uint32_t>(options_.width) << 16 | static_cast<std::uint32_t>(options_.height);
  registers_[csr + format7::kMaxImageSize] = {size, 0};
  registers_[csr + format7::kUnitSize] = {8u << 16 | 2, 0};
  registers_[csr + format7::kUnitPosition] = {2u << 16 | 2, 0};
  registers_[csr + format7::kPosition] = {0, kAll};
  registers_[csr + format7::kSize] = {size, kAll};
  registers_[csr + format7::kColorCoding] = {coding << 24, 0xff00'0000};
  registers_[csr + format7::kColorCodingInq] = {codings, 0};
  for (const std::uint32_t field : {format7::kPixelNumber, format7::kTotalBytesHi, format7::kTotalBytesLo,
                                    format7::kPacketPara, format7::kPacketsPerFrame, format7::kFrameInterval})
    registers_[csr + field] = {0, 0};
  registers_[csr + 0x054] = {8u << 24, 0};  // DATA_DEPTH_INQ
  registers_[csr + format7::kBytesPerPacket] = {0, 0xffff'0000};
  if (const auto filter = colour_filter(options_.bayer_tile))
    registers_[csr + format7::kColorFilter] = {*filter << 24, 0};
  registers_[csr + format7::kValueSetting] = {format7::setting::kPresent, format7::setting::kSetting1};
  apply_format7(csr);
}

// What follows from size and coding; its packets are as recommended until others are asked for.
void SimulatedCamera::apply_format7(std::uint32_t csr) {
  const std::uint32_t size = at(csr + format7::kSize);
  const std::uint32_t pixels = (size >> 16) * (size & 0xffff);
  const std::uint32_t bytes = pixels * static_cast<std::uint32_t>(bytes_per_pixel_.at(csr));
  const auto packets = static_cast<std::uint32_t>(8000 / options_.rate);
  const std::uint32_t wanted = (bytes + packets - 1) / packets;
  const std::uint32_t recommended =
      std::clamp((wanted + kPacketUnit - 1) / kPacketUnit * kPacketUnit, kPacketUnit, kMaxPacket);
  at(csr + format7::kPixelNumber) = pixels;
  at(csr + format7::kTotalBytesLo) = bytes;
  at(csr + format7::kPacketPara) = kPacketUnit << 16 | kMaxPacket;
  at(csr + format7::kBytesPerPacket) = recommended << 16 | recommended;
  at(csr + format7::kPacketsPerFrame) = (bytes + recommended - 1) / recommended;
  at(csr + format7::kFrameInterval) =
      std::bit_cast<std::uint32_t>(static_cast<float>(at(csr + format7::kPacketsPerFrame)) * 125e-6f);
}

void SimulatedCamera::written(std::uint32_t offset, std::uint32_t before) {
  if (offset >= kFormat7 && offset < kAbsolute)
    return written_format7(offset / kFormat7Size * kFormat7Size, offset % kFormat7Size, before);
  if (offset >= kAbsolute && offset < kStrobe) return written_absolute(offset, before);
  if (offset >= kBase + reg::kFeature && offset < kBase + reg::kFeatureLow) return written_feature(offset, before);
  switch (offset - kBase) {
    case reg::kInitialize:
      if (at(offset) != 0) factory_settings();
      break;
    case reg::kCurrentRate:
    case reg::kCurrentMode:
    case reg::kCurrentFormat:
      at(kBase + kVideoModeError) = picture() ? 0 : bit(0);
      at(kBase + reg::kDataDepth) = (picture() && picture()->bytes_per_pixel == 2 ? 16u : 8u) << 24;
      break;
    case reg::kCameraPower:
      if (at(offset) == 0) at(kBase + reg::kIsoEnable) = 0;
      break;
    case reg::kIsoEnable:
    case reg::kOneShot:
      if (!picture() || at(kBase + reg::kCameraPower) == 0) at(offset) = 0;
      if (before == 0) can_start_ = Clock::now();
      break;
    case reg::kSoftwareTrigger:
      can_start_ = Clock::now();
      break;
    default:
      break;
  }
}

void SimulatedCamera::written_feature(std::uint32_t offset, std::uint32_t before) {
  const std::uint32_t number = (offset - kBase - reg::kFeature) / 4;
  if (number == kTrigger) return written_trigger(before);
  const Feature* feature = feature_of(number);
  if (!feature) return;
  std::uint32_t& value = at(offset);
  const bool kept = value & (control::kAuto | control::kAbsolute);  // it is set by the camera, or by its absolute value
  const std::uint32_t asked = kept ? before & control::kValue : value & control::kValue;
  const std::uint32_t set = std::clamp(asked, feature->min, feature->max);
  value = (value & ~control::kValue) | set;
  if (!(feature->abilities & inquiry::kAbsolute)) return;
  const std::uint32_t csr = kAbsolute + kAbsoluteSize * number;
  const auto min = std::bit_cast<float>(at(csr + iidc::absolute::kMin));
  const auto max = std::bit_cast<float>(at(csr + iidc::absolute::kMax));
  const float part = static_cast<float>(set - feature->min) / static_cast<float>(feature->max - feature->min);
  at(csr + iidc::absolute::kValue) = std::bit_cast<std::uint32_t>(min + part * (max - min));
}

// Takes effect where the feature is told to go by it, in the steps of its plain value.
void SimulatedCamera::written_absolute(std::uint32_t offset, std::uint32_t before) {
  const std::uint32_t number = (offset - kAbsolute) / kAbsoluteSize;
  const std::uint32_t csr = kAbsolute + kAbsoluteSize * number;
  if (offset != csr + iidc::absolute::kValue) return;
  const Feature& feature = *feature_of(number);
  std::uint32_t& state = at(kBase + reg::kFeature + 4 * number);
  const auto asked = std::bit_cast<float>(at(offset));
  if (!(state & control::kAbsolute) || (state & control::kAuto) || std::isnan(asked)) {
    at(offset) = before;
    return;
  }
  const auto min = std::bit_cast<float>(at(csr + iidc::absolute::kMin));
  const auto max = std::bit_cast<float>(at(csr + iidc::absolute::kMax));
  const float part = (std::clamp(asked, min, max) - min) / (max - min);
  const auto steps = std::lround(part * static_cast<float>(feature.max - feature.min));
  state = (state & ~control::kValue) | (feature.min + static_cast<std::uint32_t>(steps));
  written_feature(kBase + reg::kFeature + 4 * number, state);
}

void SimulatedCamera::written_trigger(std::uint32_t before) {
  std::uint32_t& value = at(kBase + reg::kFeature + 4 * kTrigger);
  const std::uint32_t source = value >> control::kSourceShift & 7, mode = value >> control::kModeShift & 15;
  if ((source != 0 && source != kSoftwareSource) || mode > 1) value = before;
  edge_ = false;
  at(kBase + reg::kSoftwareTrigger) = 0;
}

void SimulatedCamera::written_format7(std::uint32_t csr, std::uint32_t field, std::uint32_t before) {
  using namespace format7;
  std::uint32_t& setting = at(csr + kValueSetting);
  const auto fits = [&] {
    const std::uint32_t size = at(csr + kSize), max = at(csr + kMaxImageSize), unit = at(csr + kUnitSize);
    const std::uint32_t place = at(csr + kPosition), step = at(csr + kUnitPosition);
    const auto along = [&](int shift) {
      const auto of = [&](std::uint32_t quadlet) { return quadlet >> shift & 0xffff; };
      return of(size) != 0 && of(size) % of(unit) == 0 && of(place) % of(step) == 0 && of(place) + of(size) <= of(max);
    };
    const std::uint32_t coding = at(csr + kColorCoding) >> 24;
    return along(16) && along(0) && coding < 32 && (at(csr + kColorCodingInq) & bit(static_cast<int>(coding)));
  };
  if (field == kValueSetting && (setting & setting::kSetting1)) {
    setting = setting::kPresent | (fits() ? 0 : setting::kError1);
    if (setting == setting::kPresent) apply_format7(csr);
  } else if (field == kBytesPerPacket) {
    std::uint32_t& packet = at(csr + kBytesPerPacket);
    const std::uint32_t asked = packet >> 16;
    setting &= ~setting::kError2;
    if (asked == 0 || asked % kPacketUnit != 0 || asked > kMaxPacket) {
      setting |= setting::kError2;
      packet = before;
    } else {
      at(csr + kPacketsPerFrame) = (at(csr + kTotalBytesLo) + asked - 1) / asked;
      at(csr + kFrameInterval) = std::bit_cast<std::uint32_t>(static_cast<float>(at(csr + kPacketsPerFrame)) * 125e-6f);
    }
  } else if (field == kSize || field == kPosition || field == kColorCoding) {
    setting |= setting::kError1;  // until it is set
  }
}

std::optional<SimulatedCamera::Picture> SimulatedCamera::picture() const {
  const std::uint32_t format = at(kBase + reg::kCurrentFormat) >> 29, mode = at(kBase + reg::kCurrentMode) >> 29;
  if (format == 7) {
    const std::uint32_t csr = kFormat7 + kFormat7Size * mode;
    const auto found = bytes_per_pixel_.find(csr);
    const std::uint32_t errors = format7::setting::kError1 | format7::setting::kError2;
    if (found == bytes_per_pixel_.end() || (at(csr + format7::kValueSetting) & errors)) return std::nullopt;
    const std::uint32_t size = at(csr + format7::kSize);
    return Picture{static_cast<int>(size >> 16), static_cast<int>(size & 0xffff), found->second,
                   at(csr + format7::kBytesPerPacket) >> 16};
  }
  const auto rate = static_cast<int>(at(kBase + reg::kCurrentRate) >> 29);
  for (const FixedMode& fixed : kFixedModes)
    if (fixed.format == format && fixed.mode == mode && rate >= kFirstRate && rate <= kLastRate)
      return Picture{fixed.width, fixed.height, fixed.bytes_per_pixel, kMaxPacket};
  return std::nullopt;
}

SimulatedCamera::Clock::duration SimulatedCamera::period(const Picture& picture) const {
  double rate = options_.rate;
  if (const std::uint32_t state = at(kBase + reg::kFeature + 4 * kFrameRate);
      (state & control::kOn) && !(state & control::kAuto))
    rate =
        static_cast<double>(std::bit_cast<float>(at(kAbsolute + kAbsoluteSize * kFrameRate + iidc::absolute::kValue)));
  if (at(kBase + reg::kCurrentFormat) >> 29 != 7)
    rate = kSlowestRate * static_cast<double>(1u << (at(kBase + reg::kCurrentRate) >> 29));
  const auto asked = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate));
  return std::max<Clock::duration>(asked, picture.bus_time());
}

bool SimulatedCamera::triggered() const {
  const std::uint32_t state = at(kBase + reg::kFeature + 4 * kTrigger);
  if (!(state & control::kOn)) return true;
  const bool by_software = (state >> control::kSourceShift & 7) == kSoftwareSource;
  return by_software ? at(kBase + reg::kSoftwareTrigger) != 0 : edge_;
}

bool SimulatedCamera::to_send() const {
  return (at(kBase + reg::kIsoEnable) != 0 || at(kBase + reg::kOneShot) != 0) && triggered() && picture();
}

}  // namespace relmap::testing
