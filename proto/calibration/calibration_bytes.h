// The bytes of a stereo calibration, as they stand in a camera's log and in a session's header. Decoding gives the same
// calibration to the last bit.
#pragma once

#include "proto/base/bytes.h"
#include "proto/calibration/calibration.h"

namespace relmap {

Bytes encode_calibration(const StereoCalibration& calibration);

// CORRUPT: bytes that encode_calibration() never writes. Does not check that the calibration is plausible.
Result<StereoCalibration> decode_calibration(ByteSpan bytes);

}  // namespace relmap
