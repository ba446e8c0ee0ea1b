#include "proto/calibration/calibration_bytes.h"

#include <gtest/gtest.h>

#include "proto/calibration/calibration_samples.h"

namespace relmap {
namespace {

TEST(CalibrationBytes, AreTheSameCalibrationToTheLastBit) {
  StereoCalibration calibration = sample_raw_calibration();
  calibration.rectified = true;
  calibration.T_body_left = SE3::exp(Vector6::Constant(0.3));
  const auto back = decode_calibration(encode_calibration(calibration));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back, calibration);
}

TEST(CalibrationBytes, OfAnotherLengthAreRefused) {
  Bytes bytes = encode_calibration({});
  bytes.push_back(0);
  EXPECT_EQ(decode_calibration(bytes).reason(), Reason::CORRUPT);
  for (const std::size_t size : {bytes.size() - 2, std::size_t{1}, std::size_t{0}})
    EXPECT_EQ(decode_calibration(ByteSpan(bytes).first(size)).reason(), Reason::CORRUPT);
}

// Bytes that decode are encoded to the same bytes again, so a flag must have only one encoding.
TEST(CalibrationBytes, WithAFlagOtherThanZeroOrOneAreRefused) {
  Bytes bytes = encode_calibration(sample_raw_calibration());
  constexpr std::size_t kFlag = 8;  // behind the width and the height
  bytes[kFlag] = 2;
  EXPECT_EQ(decode_calibration(bytes).reason(), Reason::CORRUPT);
}

}  // namespace
}  // namespace relmap
