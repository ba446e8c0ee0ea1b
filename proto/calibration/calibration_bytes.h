// A stereo calibration in a record of relmap's own, bit for bit: in the log of a camera and in a session's header.
#pragma once

#include "proto/base/bytes.h"
#include "proto/calibration/calibration.h"

namespace relmap {

Bytes encode_calibration(const StereoCalibration& calibration);

// CORRUPT: bytes that encode_calibration() never writes. Whether the calibration is plausible is not asked.
Result<StereoCalibration> decode_calibration(ByteSpan bytes);

}  // namespace relmap
