#include "frontend/capture/calibration_bytes.h"

#include <gtest/gtest.h>

#include "frontend/capture/testing/raw_logs.h"

namespace relmap {
namespace {

TEST(CalibrationBytes, AreTheSameCalibrationToTheLastBit) {
  StereoCalibration calibration = testing_files::raw_calibration();
  calibration.rectified = true;
  calibration.T_body_left = SE3::exp(Vector6::Constant(0.3));
  const auto back = decode_calibration(encode_calibration(calibration));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->left, calibration.left);
  EXPECT_EQ(back->right, calibration.right);
  EXPECT_EQ(back->width, calibration.width);
  EXPECT_EQ(back->height, calibration.height);
  EXPECT_TRUE(back->rectified);
  EXPECT_EQ(back->T_right_left.R, calibration.T_right_left.R);
  EXPECT_EQ(back->T_right_left.t, calibration.T_right_left.t);
  EXPECT_EQ(back->T_body_left.R, calibration.T_body_left.R);
  EXPECT_EQ(back->T_body_left.t, calibration.T_body_left.t);
}

TEST(CalibrationBytes, OfAnotherLengthAreRefused) {
  Bytes bytes = encode_calibration({});
  bytes.push_back(0);
  EXPECT_EQ(decode_calibration(bytes).reason(), Reason::CORRUPT);
  for (const std::size_t size : {bytes.size() - 2, std::size_t{1}, std::size_t{0}})
    EXPECT_EQ(decode_calibration(ByteSpan(bytes).first(size)).reason(), Reason::CORRUPT);
}

}  // namespace
}  // namespace relmap
