// The video modes of a camera, and the choice of one that carries two eyes.
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
  int width = 0, height = 0;            // Format7: the maximum
  int unit_width = 0, unit_height = 0;  // Format7: step of sizes; otherwise 0
  std::vector<Coding> codings;
  std::vector<double> rates_hz;  // Formats 0 and 2 only; the rates of Format7 depend on packets
};

// Reads the modes of Formats 0, 2 and 7. Other formats are left out.
Result<std::vector<ModeInfo>> read_modes(const RegisterFile& registers);

struct StreamWish {
  // If not set, the first mode that carries two eyes, in this order: Format7 mode 3, others of Format7, Format 0,
  // Format 2.
  std::optional<VideoMode> mode;
  int width = 0, height = 0;  // Format7 only; 0 for the maximum
  double rate_hz = 0;         // 0 for the maximum
};

// The format that the camera has been set to.
struct StreamFormat {
  VideoMode mode;
  int width = 0, height = 0;
  Coding coding{};
  capture::ColourFilter filter = capture::ColourFilter::kNone;
  double rate_hz = 0;           // 0 if not known
  std::size_t image_bytes = 0;  // size of the pixels
  std::size_t frame_bytes = 0;  // with the padding of the last packet

  std::string describe() const;  // "format7.3, 640 x 480 RAW16 at 48/s"
};

// Stops the camera's stream and sets the camera up; everything is read back. UNSUPPORTED if no mode, or not the mode in
// `wish`, carries 16-bit words, or it does not have that size; REGISTER_REFUSED, also if Format7 reports an error of
// its settings; CORRUPT if the camera reports impossible sizes.
Result<StreamFormat> set_stream(const RegisterFile& registers, const StreamWish& wish);

// Sets ISO_EN. It is read back if `on`.
Status set_sending(const RegisterFile& registers, bool on);

}  // namespace relmap::iidc
