#include "frontend/capture/imu_csv.h"

#include <gtest/gtest.h>

#include <string>

#include "frontend/capture/capture_time.h"

namespace relmap::capture {
namespace {

TEST(ImuCsv, IsEurocs) {
  const auto samples = parse_imu_csv(
      "#timestamp [ns],w_x [rad s^-1],w_y,w_z,a_x [m s^-2],a_y,a_z\r\n"
      "1403636579758555392,-0.099134701513277898,0.1473,0.0272,8.1476917083333333,-0.3759,-2.4026\r\n"
      "1403636579763555584, -0.0991, 0.1403, 0.0293, 8.0332, -0.4086, -2.4026\r\n");
  ASSERT_TRUE(samples.ok()) << samples.status().to_string();
  ASSERT_EQ(samples->size(), 2u);
  EXPECT_EQ((*samples)[0].time_us, 1'403'636'579'758'555);
  EXPECT_EQ((*samples)[0].gyro, Vector3(-0.099134701513277898, 0.1473, 0.0272));
  EXPECT_EQ((*samples)[0].acceleration, Vector3(8.1476917083333333, -0.3759, -2.4026));
  EXPECT_EQ((*samples)[1].gyro.x(), -0.0991);
}

TEST(ImuCsv, PutsRelativeTimesWhereThoseOfPicturesAre) {
  const auto samples = parse_imu_csv("0,0,0,0,0,0,9.81\n5000000,0,0,0,0,0,9.81");
  ASSERT_TRUE(samples.ok()) << samples.status().to_string();
  EXPECT_EQ((*samples)[0].time_us, kRelativeTimeBaseUs);
  EXPECT_EQ((*samples)[1].time_us, kRelativeTimeBaseUs + 5000);
}

TEST(ImuCsv, RefusesByNameAndLine) {
  const std::string good = "# of a unit\n1000000,0,0,0,0,0,9.81\n";
  struct Bad {
    const char* line;
    Reason reason;
  };
  for (const Bad& bad :
       {Bad{"2000000,0,0,0,0,0\n", Reason::CORRUPT}, Bad{"2000000,0,0,0,0,0,0,0\n", Reason::CORRUPT},
        Bad{"soon,0,0,0,0,0,0\n", Reason::CORRUPT}, Bad{"-2000000,0,0,0,0,0,0\n", Reason::CORRUPT},
        Bad{"2000000,0,x,0,0,0,0\n", Reason::CORRUPT}, Bad{"2000000,0,1 1,0,0,0,0\n", Reason::CORRUPT},
        Bad{"2000000,0,1e999,0,0,0,0\n", Reason::CORRUPT}, Bad{"2000000,0,nan,0,0,0,0\n", Reason::NOT_FINITE},
        Bad{"2000000,0,0,0,0,0,-inf\n", Reason::NOT_FINITE}, Bad{"1000000,0,0,0,0,0,0\n", Reason::TIME_BACKWARDS},
        Bad{"999999,0,0,0,0,0,0\n", Reason::TIME_BACKWARDS}}) {
    const auto samples = parse_imu_csv(good + bad.line);
    EXPECT_EQ(samples.reason(), bad.reason) << bad.line << samples.status().to_string();
    EXPECT_NE(samples.status().message().find("line 3"), std::string::npos) << samples.status().to_string();
  }
  for (const char* none : {"", "\n\n", "#timestamp [ns]\n"})
    EXPECT_EQ(parse_imu_csv(none).reason(), Reason::BAD_SIZE) << none;
}

}  // namespace
}  // namespace relmap::capture
