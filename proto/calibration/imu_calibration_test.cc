#include "proto/calibration/imu_calibration.h"

#include <gtest/gtest.h>

#include <string>

namespace relmap {
namespace {

std::string sensor(const std::string& noise = "1.6968e-04", const std::string& more = "",
                   const std::string& corner = "0") {
  return "%YAML:1.0\nsensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n  data: [" + corner +
         ", -1, 0, 0.1,\n 1, 0, 0, 0.2,\n 0, 0, 1, 0.3,\n 0, 0, 0, 1]\nrate_hz: 200\n"
         "gyroscope_noise_density: " +
         noise + "     # [ rad / s / sqrt(Hz) ]\ngyroscope_random_walk: 1.9393e-05\n" + more;
}

TEST(ImuCalibration, IsReadFromEurocsFormat) {
  const auto imu = parse_imu_calibration(sensor());
  ASSERT_TRUE(imu.ok()) << imu.status().to_string();
  EXPECT_EQ(imu->gyro_noise, 1.6968e-04);
  EXPECT_EQ(imu->gyro_walk, 1.9393e-05);
  EXPECT_EQ(imu->time_shift_s, 0);
  EXPECT_LT((imu->T_body_imu * Vector3(1, 0, 0) - Vector3(0.1, 1.2, 0.3)).norm(), 1e-12);
}

TEST(ImuCalibration, MaySayByHowMuchTheClocksDiffer) {
  EXPECT_EQ(parse_imu_calibration(sensor("1e-4", "timeshift_cam_imu: -0.0125\n"))->time_shift_s, -0.0125);
}

TEST(ImuCalibration, BadTextIsRefusedWithItsReason) {
  EXPECT_EQ(parse_imu_calibration("").reason(), Reason::CORRUPT);
  EXPECT_EQ(parse_imu_calibration("just text").reason(), Reason::CORRUPT);
  EXPECT_EQ(parse_imu_calibration("gyroscope_noise_density: 1e-4\n").reason(), Reason::CORRUPT);
  EXPECT_EQ(parse_imu_calibration(sensor("soon")).reason(), Reason::CORRUPT);
  const std::string whole = sensor();
  const auto without_walk = parse_imu_calibration(whole.substr(0, whole.find("gyroscope_random_walk")));
  EXPECT_EQ(without_walk.reason(), Reason::CORRUPT);
  EXPECT_NE(without_walk.status().message().find("gyroscope_random_walk"), std::string::npos);
  for (const char* noise : {"0", "-1e-4", "2", ".nan", ".inf"})
    EXPECT_EQ(parse_imu_calibration(sensor(noise)).reason(), Reason::IMPLAUSIBLE_CALIBRATION) << noise;
  for (const char* shift : {"11", "-11", ".nan"})
    EXPECT_EQ(parse_imu_calibration(sensor("1e-4", std::string("timeshift_cam_imu: ") + shift)).reason(),
              Reason::IMPLAUSIBLE_CALIBRATION)
        << shift;
  EXPECT_EQ(parse_imu_calibration(sensor("1e-4", "", "1")).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
}

}  // namespace
}  // namespace relmap
