#include "proto/keyframe/header_extensions.h"

#include <utility>

#include "proto/calibration/calibration_bytes.h"
#include "proto/keyframe/extension_codec.h"

namespace relmap {

namespace {

constexpr std::uint32_t kRawCalibration = 21;

}  // namespace

Extensions header_extensions(const SessionHeader& header) {
  Extensions all = header.unknown;
  if (header.raw) add_extension(all, kRawCalibration, encode_calibration(*header.raw));
  return all;
}

bool set_header_extensions(SessionHeader& header, Extensions all) {
  const auto raw = take_extension(all, kRawCalibration);
  header.unknown = std::move(all);
  if (!raw) return true;
  auto calibration = decode_calibration(*raw);
  if (!calibration.ok()) return false;
  header.raw = std::move(*calibration);
  return true;
}

}  // namespace relmap
