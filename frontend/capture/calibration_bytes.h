// A stereo calibration in a record of relmap's own, bit for bit: where what was measured must be seen again elsewhere.
#pragma once

#include "proto/bytes.h"
#include "proto/calibration.h"

namespace relmap {

Bytes encode_calibration(const StereoCalibration& calibration);

// CORRUPT: of another length. Whether it is plausible is not asked.
Result<StereoCalibration> decode_calibration(ByteSpan bytes);

}  // namespace relmap
