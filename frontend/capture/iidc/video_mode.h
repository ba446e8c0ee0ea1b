// The pictures that a camera can send, and the choice of those that carry two eyes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "frontend/capture/iidc/register_file.h"
#include "frontend/capture/stereo_layout.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// COLOR_CODING_ID (Format_7): the numbers are the specification's.
enum class Coding : std::uint8_t {
  kMono8,
  kYuv411,
  kYuv422,
  kYuv444,
  kRgb8,
  kMono16,
  kRgb16,
  kSignedMono16,
  kSignedRgb16,
  kRaw8,
  kRaw16,
};
std::string_view coding_name(Coding coding);  // "RAW16"
int bits_per_pixel(Coding coding);

struct VideoMode {
  int format = 7, mode = 0;

  // "format7.3"
  std::string name() const;
  static std::optional<VideoMode> parse(std::string_view text);
  bool operator==(const VideoMode&) const = default;
};

struct ModeInfo {
  VideoMode mode;
  int width = 0, height = 0;            // Format7: the largest
  int unit_width = 0, unit_height = 0;  // Format7: of sizes; else 0
  std::vector<Coding> codings;
  std::vector<double> rates_hz;  // Formats 0 and 2: those of the camera. Format7: as packets allow
};

// Formats 0, 2 and 7. Others that the camera has are left out.
Result<std::vector<ModeInfo>> read_modes(const RegisterFile& registers);

struct StreamWish {
  std::optional<VideoMode> mode;  // none: the first that carries two eyes: Format7 mode 3, another of Format7, 0, 2
  int width = 0, height = 0;      // Format7; 0: the largest
  double rate_hz = 0;             // 0: the fastest
};

// What the camera has been set to.
struct StreamFormat {
  VideoMode mode;
  int width = 0, height = 0;
  Coding coding{};
  capture::ColourFilter filter = capture::ColourFilter::kNone;
  double rate_hz = 0;           // 0: not known
  std::size_t image_bytes = 0;  // of the pixels
  std::size_t frame_bytes = 0;  // with what fills the last packet

  std::string describe() const;  // "format7.3, 640 x 480 RAW16 at 48/s"
};

// Stops what the camera sends, and sets it up; everything is read back. UNSUPPORTED: no mode, or not the one wished
// for, carries words of 16 bits, or it has not that size; REGISTER_REFUSED: also where Format7 reports an error of its
// settings; CORRUPT: it tells sizes that cannot be.
Result<StreamFormat> set_stream(const RegisterFile& registers, const StreamWish& wish);

// ISO_EN. Read back where on.
Status set_sending(const RegisterFile& registers, bool on);

}  // namespace relmap::iidc
