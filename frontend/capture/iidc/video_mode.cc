#include "frontend/capture/iidc/video_mode.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "frontend/capture/iidc/features.h"
#include "frontend/capture/iidc/registers.h"

namespace relmap::iidc {

namespace {

struct CodingFacts {
  const char* name;
  int bits;
};
constexpr std::array<CodingFacts, 11> kCodings = {{{"MONO8", 8},
                                                   {"YUV411", 12},
                                                   {"YUV422", 16},
                                                   {"YUV444", 24},
                                                   {"RGB8", 24},
                                                   {"MONO16", 16},
                                                   {"RGB16", 48},
                                                   {"SMONO16", 16},
                                                   {"SRGB16", 48},
                                                   {"RAW8", 8},
                                                   {"RAW16", 16}}};

struct FixedMode {
  int width, height;
  Coding coding;
};
// The modes of Formats 0 and 2 [2.1.1, 2.1.3].
constexpr std::array<FixedMode, 7> kFormat0 = {{{160, 120, Coding::kYuv444},
                                                {320, 240, Coding::kYuv422},
                                                {640, 480, Coding::kYuv411},
                                                {640, 480, Coding::kYuv422},
                                                {640, 480, Coding::kRgb8},
                                                {640, 480, Coding::kMono8},
                                                {640, 480, Coding::kMono16}}};
constexpr std::array<FixedMode, 8> kFormat2 = {{{1280, 960, Coding::kYuv422},
                                                {1280, 960, Coding::kRgb8},
                                                {1280, 960, Coding::kMono8},
                                                {1600, 1200, Coding::kYuv422},
                                                {1600, 1200, Coding::kRgb8},
                                                {1600, 1200, Coding::kMono8},
                                                {1280, 960, Coding::kMono16},
                                                {1600, 1200, Coding::kMono16}}};
constexpr std::array<double, 8> kRates = {1.875, 3.75, 7.5, 15, 30, 60, 120, 240};

constexpr int kMaxSide = 8192;
constexpr double kPacketsPerSecond = 8000;  // IEEE 1394: one a cycle
constexpr auto kPowerUp = std::chrono::milliseconds(1000), kSettle = std::chrono::milliseconds(500),
               kPoll = std::chrono::milliseconds(2);

// The codings that carry two eyes: 16-bit words.
std::optional<Coding> stereo_coding(const ModeInfo& info) {
  for (const Coding wanted : {Coding::kRaw16, Coding::kMono16, Coding::kYuv422})
    if (std::find(info.codings.begin(), info.codings.end(), wanted) != info.codings.end()) return wanted;
  return std::nullopt;
}

std::uint32_t mode_offset(const VideoMode& mode) { return 4u * static_cast<std::uint32_t>(mode.mode); }

Result<RegisterFile> csr_of(const RegisterFile& registers, const VideoMode& mode) {
  return registers.at(reg::kFormat7CsrInq + mode_offset(mode));
}

int high(std::uint32_t quadlet) { return static_cast<int>(quadlet >> 16); }
int low(std::uint32_t quadlet) { return static_cast<int>(quadlet & 0xffff); }
std::uint32_t both(int upper, int lower) {
  return static_cast<std::uint32_t>(upper) << 16 | static_cast<std::uint32_t>(lower);
}

Result<ModeInfo> read_fixed(const RegisterFile& registers, VideoMode mode, const FixedMode& fixed) {
  ModeInfo info{mode, fixed.width, fixed.height, 0, 0, {fixed.coding}, {}};
  const auto rates = registers.read(reg::kRateInq + 0x20 * static_cast<std::uint32_t>(mode.format) + mode_offset(mode));
  if (!rates.ok()) return rates.status();
  for (std::size_t i = 0; i < kRates.size(); ++i)
    if (*rates & kOn >> i) info.rates_hz.push_back(kRates[i]);
  return info;
}

Result<ModeInfo> read_format7(const RegisterFile& registers, VideoMode mode) {
  const auto csr = csr_of(registers, mode);
  if (!csr.ok()) return csr.status();
  ModeInfo info;
  info.mode = mode;
  const auto size = csr->read(format7::kMaxImageSize);
  if (!size.ok()) return size.status();
  const auto unit = csr->read(format7::kUnitSize);
  if (!unit.ok()) return unit.status();
  const auto codings = csr->read(format7::kColorCodingInq);
  if (!codings.ok()) return codings.status();
  info.width = high(*size);
  info.height = low(*size);
  info.unit_width = std::max(1, high(*unit));
  info.unit_height = std::max(1, low(*unit));
  if (info.width < 1 || info.height < 1 || info.width > kMaxSide || info.height > kMaxSide)
    return {Reason::CORRUPT, mode.name() + " says that its pictures are of " + std::to_string(info.width) + " x " +
                                 std::to_string(info.height)};
  for (std::size_t i = 0; i < kCodings.size(); ++i)
    if (*codings & kOn >> i) info.codings.push_back(static_cast<Coding>(i));
  return info;
}

Status cannot(const VideoMode& mode, const std::string& why) { return {Reason::UNSUPPORTED, mode.name() + ": " + why}; }

// VALUE_SETTING makes the camera check size, position and coding; it checks the size of packets when that is written.
// Cameras from before IIDC 1.31 do not have this register.
Result<std::optional<std::uint32_t>> value_setting(const RegisterFile& csr) {
  const auto there = csr.read(format7::kValueSetting);
  if (there.reason() == Reason::IO_ERROR) return std::optional<std::uint32_t>();
  if (!there.ok()) return there.status();
  return *there & format7::setting::kPresent ? std::optional(*there) : std::nullopt;
}

Status take_settings(const RegisterFile& csr, const VideoMode& mode) {
  const auto there = value_setting(csr);
  if (!there.ok() || !*there) return there.status();
  if (Status status = csr.write(format7::kValueSetting, format7::setting::kPresent | format7::setting::kSetting1);
      !status.ok())
    return status;
  const auto until = std::chrono::steady_clock::now() + kSettle;
  for (;;) {
    const auto now = csr.read(format7::kValueSetting);
    if (!now.ok()) return now.status();
    if (!(*now & format7::setting::kSetting1)) {
      if (!(*now & format7::setting::kError1)) return {};
      return {Reason::REGISTER_REFUSED,
              mode.name() + ": the camera does not take the size, position and coding that were set"};
    }
    if (std::chrono::steady_clock::now() > until)
      return {Reason::REGISTER_REFUSED, mode.name() + ": VALUE_SETTING (register 07Ch) does not come to an end"};
    std::this_thread::sleep_for(kPoll);
  }
}

Status check_packets(const RegisterFile& csr, const VideoMode& mode, int packet) {
  const auto there = value_setting(csr);
  if (!there.ok() || !*there || !(**there & format7::setting::kError2)) return there.status();
  return {Reason::REGISTER_REFUSED,
          mode.name() + ": the camera does not take packets of " + std::to_string(packet) + " bytes"};
}

// The size in whole packets. The register of the total (TOTAL_BYTES_INQ) includes the padding of the last one only in
// some cameras.
Result<std::uint64_t> sent_bytes(const RegisterFile& csr, std::uint32_t packet) {
  const auto upper = csr.read(format7::kTotalBytesHi), lower = csr.read(format7::kTotalBytesLo);
  if (!upper.ok()) return upper.status();
  if (!lower.ok()) return lower.status();
  const std::uint64_t total = std::uint64_t{*upper} << 32 | *lower;
  const auto packets = csr.read(format7::kPacketsPerFrame);
  if (!packets.ok() && packets.reason() != Reason::IO_ERROR) return packets.status();
  const std::uint64_t whole = (total + packet - 1) / packet * packet;
  return packets.ok() ? std::max(whole, std::uint64_t{*packets} * packet) : whole;
}

Result<capture::ColourFilter> read_filter(const RegisterFile& csr, Coding coding) {
  if (coding != Coding::kRaw16) return capture::ColourFilter::kNone;
  const auto id = csr.read(format7::kColorFilter);
  if (id.reason() == Reason::IO_ERROR) return capture::ColourFilter::kNone;  // before IIDC 1.31
  if (!id.ok()) return id.status();
  switch (*id >> 24) {
    case 0:
      return capture::ColourFilter::kRGGB;
    case 1:
      return capture::ColourFilter::kGBRG;
    case 2:
      return capture::ColourFilter::kGRBG;
    case 3:
      return capture::ColourFilter::kBGGR;
    default:
      return capture::ColourFilter::kNone;
  }
}

// Limits the rate by the rate feature, if packets alone would allow a higher one. Returns the rate, 0 if not known.
Result<double> limit_rate(const RegisterFile& registers, double rate_hz) {
  const auto feature = read_feature(registers, Feature::kFrameRate);
  if (feature.reason() == Reason::UNSUPPORTED) return 0.0;
  if (!feature.ok()) return feature.status();
  if (!feature->absolute || !feature->can_be_set) return 0.0;
  double wanted = rate_hz > 0 ? rate_hz : feature->absolute_max;
  wanted = std::clamp<double>(wanted, feature->absolute_min, feature->absolute_max);
  FeatureSetting setting;
  setting.feature = Feature::kFrameRate;
  setting.how = FeatureSetting::How::kAbsolute;
  setting.absolute = static_cast<float>(wanted);
  if (Status status = set_feature(registers, setting); !status.ok()) return status;
  const auto now = read_feature(registers, Feature::kFrameRate);
  if (!now.ok()) return now.status();
  return now->absolute_value;
}

Result<StreamFormat> set_format7(const RegisterFile& registers, const ModeInfo& info, const StreamWish& wish) {
  const auto csr = csr_of(registers, info.mode);
  if (!csr.ok()) return csr.status();
  StreamFormat format;
  format.mode = info.mode;
  format.width = wish.width > 0 ? wish.width : info.width;
  format.height = wish.height > 0 ? wish.height : info.height;
  format.coding = *stereo_coding(info);
  if (format.width > info.width || format.height > info.height || format.width % info.unit_width != 0 ||
      format.height % info.unit_height != 0)
    return cannot(info.mode, "pictures of " + std::to_string(format.width) + " x " + std::to_string(format.height) +
                                 " cannot be had: " + std::to_string(info.width) + " x " + std::to_string(info.height) +
                                 " at most, in steps of " + std::to_string(info.unit_width) + " x " +
                                 std::to_string(info.unit_height));
  const auto step = csr->read(format7::kUnitPosition);  // 0, or missing: that of sizes
  const int step_x = step.ok() && high(*step) > 0 ? high(*step) : info.unit_width;
  const int step_y = step.ok() && low(*step) > 0 ? low(*step) : info.unit_height;
  const int left = (info.width - format.width) / 2 / step_x * step_x;
  const int top = (info.height - format.height) / 2 / step_y * step_y;
  // At 0, 0 any size fits; a smaller picture is then moved to the middle.
  if (Status status = csr->write_kept(format7::kPosition, 0, ~0u, "IMAGE_POSITION"); !status.ok()) return status;
  if (Status status = csr->write_kept(format7::kSize, both(format.width, format.height), ~0u, "IMAGE_SIZE");
      !status.ok())
    return status;
  if (left > 0 || top > 0)
    if (Status status = csr->write_kept(format7::kPosition, both(left, top), ~0u, "IMAGE_POSITION"); !status.ok())
      return status;
  if (Status status = csr->write_kept(format7::kColorCoding, static_cast<std::uint32_t>(format.coding) << 24,
                                      0xff00'0000, "COLOR_CODING_ID");
      !status.ok())
    return status;
  if (Status status = take_settings(*csr, info.mode); !status.ok()) return status;

  const auto para = csr->read(format7::kPacketPara);
  if (!para.ok()) return para.status();
  const int unit = high(*para), max_packet = low(*para);
  if (unit < 1 || max_packet < unit) return cannot(info.mode, "its packets are of no size (PACKET_PARA_INQ)");
  const double picture = static_cast<double>(format.width) * format.height * bits_per_pixel(format.coding) / 8;
  // There is one packet a cycle, with as many bytes as the rate needs.
  int packet = max_packet / unit * unit;
  if (wish.rate_hz > 0) {
    const double needed = std::ceil(picture * wish.rate_hz / kPacketsPerSecond / unit) * unit;
    packet = static_cast<int>(std::min<double>(packet, std::max<double>(unit, needed)));
  }
  if (Status status = csr->write_kept(format7::kBytesPerPacket, both(packet, 0), 0xffff'0000, "BYTE_PER_PACKET");
      !status.ok())
    return status;
  if (Status status = check_packets(*csr, info.mode, packet); !status.ok()) return status;
  format.image_bytes = static_cast<std::size_t>(picture);
  const auto bytes = sent_bytes(*csr, static_cast<std::uint32_t>(packet));
  if (!bytes.ok()) return bytes.status();
  if (*bytes < format.image_bytes || *bytes > format.image_bytes + 65536)
    return {Reason::CORRUPT, info.mode.name() + " says that a frame has " + std::to_string(*bytes) +
                                 " bytes, where its pixels take " + std::to_string(format.image_bytes)};
  format.frame_bytes = *bytes;
  const auto filter = read_filter(*csr, format.coding);
  if (!filter.ok()) return filter.status();
  format.filter = *filter;
  format.rate_hz = kPacketsPerSecond / std::ceil(static_cast<double>(*bytes) / packet);
  return format;
}

Result<StreamFormat> set_fixed(const RegisterFile& registers, const ModeInfo& info, const StreamWish& wish) {
  if ((wish.width > 0 && wish.width != info.width) || (wish.height > 0 && wish.height != info.height))
    return cannot(info.mode, "its pictures are of " + std::to_string(info.width) + " x " + std::to_string(info.height));
  if (info.rates_hz.empty()) return cannot(info.mode, "it has no rate");
  StreamFormat format;
  format.mode = info.mode;
  format.width = info.width;
  format.height = info.height;
  format.coding = info.codings.front();
  // The slowest rate that is not below the one wished for.
  format.rate_hz = info.rates_hz.back();
  for (const double rate : info.rates_hz)
    if (wish.rate_hz > 0 && rate >= wish.rate_hz && rate < format.rate_hz) format.rate_hz = rate;
  const auto index =
      static_cast<std::uint32_t>(std::find(kRates.begin(), kRates.end(), format.rate_hz) - kRates.begin());
  if (Status status = registers.write_kept(reg::kCurrentRate, index << 29, 0xe000'0000, "CUR_V_FRM_RATE"); !status.ok())
    return status;
  format.image_bytes = format.frame_bytes = static_cast<std::size_t>(info.width) *
                                            static_cast<std::size_t>(info.height) *
                                            static_cast<std::size_t>(bits_per_pixel(format.coding)) / 8;
  return format;
}

// CAMERA_POWER is optional (BASIC_FUNC_INQ, bit 16). A camera without power may answer anything.
Status power_on(const RegisterFile& registers) {
  const auto functions = registers.read(reg::kBasicFuncInq);
  if (!functions.ok()) return functions.reason() == Reason::IO_ERROR ? Status() : functions.status();
  if (!(*functions & kOn >> 16)) return {};
  const auto now = registers.read(reg::kCameraPower);
  if (now.ok() && *now & kOn) return {};
  if (Status status = registers.write(reg::kCameraPower, kOn); !status.ok()) return status;
  const auto until = std::chrono::steady_clock::now() + kPowerUp;
  for (;;) {
    const auto power = registers.read(reg::kCameraPower);
    if (power.ok() && *power & kOn) return {};
    if (power.reason() == Reason::CAMERA_GONE) return power.status();
    if (std::chrono::steady_clock::now() > until)
      return {Reason::REGISTER_REFUSED, "CAMERA_POWER (register 610h) stays off"};
    std::this_thread::sleep_for(kPoll);
  }
}

Result<ModeInfo> choose(const std::vector<ModeInfo>& modes, const StreamWish& wish) {
  if (wish.mode) {
    for (const ModeInfo& info : modes)
      if (info.mode == *wish.mode) {
        if (stereo_coding(info)) return info;
        std::string codings;
        for (const Coding coding : info.codings) codings += ' ' + std::string(coding_name(coding));
        return cannot(info.mode, "it carries one eye (" + (codings.empty() ? codings : codings.substr(1)) +
                                     "), not two in words of 16 bits");
      }
    std::string names;
    for (const ModeInfo& info : modes) names += ' ' + info.mode.name();
    return cannot(*wish.mode, "the camera has not this mode, but" + names);
  }
  const auto rank = [](const VideoMode& mode) {
    return mode == VideoMode{7, 3} ? 0 : mode.format == 7 ? 1 : mode.format == 0 ? 2 : 3;
  };
  const ModeInfo* best = nullptr;
  for (const ModeInfo& info : modes)
    if (stereo_coding(info) && (!best || rank(info.mode) < rank(best->mode))) best = &info;
  if (best) return *best;
  return {Reason::UNSUPPORTED, "the camera has no mode that carries two eyes in words of 16 bits"};
}

}  // namespace

std::string_view coding_name(Coding coding) { return kCodings[static_cast<std::size_t>(coding)].name; }
int bits_per_pixel(Coding coding) { return kCodings[static_cast<std::size_t>(coding)].bits; }

std::string VideoMode::name() const { return "format" + std::to_string(format) + '.' + std::to_string(mode); }

std::optional<VideoMode> VideoMode::parse(std::string_view text) {
  constexpr std::string_view kPrefix = "format";
  if (text.size() != kPrefix.size() + 3 || !text.starts_with(kPrefix) || text[7] != '.') return std::nullopt;
  const VideoMode mode{text[6] - '0', text[8] - '0'};
  const bool known = mode.format == 0 || mode.format == 2 || mode.format == 7;
  if (!known || mode.mode < 0 || mode.mode > 7) return std::nullopt;
  return mode;
}

std::string StreamFormat::describe() const {
  char text[96];
  std::snprintf(text, sizeof text, "%s, %d x %d %s", mode.name().c_str(), width, height,
                std::string(coding_name(coding)).c_str());
  std::string described = text;
  std::snprintf(text, sizeof text, " at %g/s", std::round(100 * rate_hz) / 100);
  return rate_hz > 0 ? described + text : described;
}

Result<std::vector<ModeInfo>> read_modes(const RegisterFile& registers) {
  const auto formats = registers.read(reg::kFormatInq);
  if (!formats.ok()) return formats.status();
  std::vector<ModeInfo> modes;
  for (const int format : {0, 2, 7}) {
    if (!(*formats & kOn >> format)) continue;
    const auto has = registers.read(reg::kModeInq + 4u * static_cast<std::uint32_t>(format));
    if (!has.ok()) return has.status();
    for (int mode = 0; mode < 8; ++mode) {
      if (!(*has & kOn >> mode) || (format == 0 && mode == 7)) continue;
      const auto at = static_cast<std::size_t>(mode);
      auto info = format == 7   ? read_format7(registers, {7, mode})
                  : format == 0 ? read_fixed(registers, {0, mode}, kFormat0[at])
                                : read_fixed(registers, {2, mode}, kFormat2[at]);
      if (info.reason() == Reason::UNSUPPORTED) continue;  // its registers are nowhere
      if (!info.ok()) return info.status();
      modes.push_back(std::move(*info));
    }
  }
  return modes;
}

Result<StreamFormat> set_stream(const RegisterFile& registers, const StreamWish& wish) {
  if (Status status = power_on(registers); !status.ok()) return status;
  if (Status status = set_sending(registers, false); !status.ok()) return status;
  const auto modes = read_modes(registers);
  if (!modes.ok()) return modes.status();
  const auto info = choose(*modes, wish);
  if (!info.ok()) return info.status();
  const VideoMode& mode = info->mode;
  const std::uint32_t upper = 0xe000'0000;
  if (Status status = registers.write_kept(reg::kCurrentFormat, static_cast<std::uint32_t>(mode.format) << 29, upper,
                                           "CUR_V_FORMAT");
      !status.ok())
    return status;
  if (Status status =
          registers.write_kept(reg::kCurrentMode, static_cast<std::uint32_t>(mode.mode) << 29, upper, "CUR_V_MODE");
      !status.ok())
    return status;
  auto format = mode.format == 7 ? set_format7(registers, *info, wish) : set_fixed(registers, *info, wish);
  if (!format.ok() || mode.format != 7) return format;
  const auto limited = limit_rate(registers, wish.rate_hz);
  if (!limited.ok()) return limited.status();
  if (*limited > 0) format->rate_hz = std::min(format->rate_hz, *limited);
  return format;
}

Status set_sending(const RegisterFile& registers, bool on) {
  if (!on) return registers.write(reg::kIsoEnable, 0);
  return registers.write_kept(reg::kIsoEnable, kOn, kOn, "ISO_EN");
}

}  // namespace relmap::iidc
