#include "frontend/capture/imu_file.h"

#include <gtest/gtest.h>

#include "frontend/capture/capture_time.h"
#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

using testing_files::TemporaryFolder;
using testing_files::write_text;

constexpr const char* kSamples =
    "#timestamp [ns],w_x [rad s^-1],w_y,w_z,a_x [m s^-2],a_y,a_z\r\n"
    "1403636579758555392,-0.099134701513277898,0.1473,0.0272,8.1476917083333333,-0.3759,-2.4026\r\n"
    "1403636579763555584, -0.0991, 0.1403, 0.0293, 8.0332, -0.4086, -2.4026\r\n";

// The unit's x is the body's y.
std::string imu_sensor(const std::string& more = "") {
  return "%YAML:1.0\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
         "gyroscope_noise_density: 2e-4\ngyroscope_random_walk: 3e-5\n" +
         more;
}

TEST(ReadImu, TurnsTheUnitIntoTheLeftCamera) {
  TemporaryFolder folder;
  write_text(folder.path() / "mav0/imu0/data.csv", kSamples);
  write_text(folder.path() / "mav0/imu0/sensor.yaml", imu_sensor());
  // The camera's z is the body's x.
  SE3 T_body_camera;
  T_body_camera.R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (const char* place : {"", "mav0", "mav0/imu0", "mav0/imu0/data.csv"}) {
    const auto imu = read_imu((folder.path() / place).string(), T_body_camera);
    ASSERT_TRUE(imu.ok()) << place << ": " << imu.status().to_string();
    EXPECT_EQ(imu->samples.size(), 2u);
    EXPECT_EQ(imu->calibration.gyro_noise, 2e-4);
    EXPECT_EQ(imu->calibration.gyro_walk, 3e-5);
    EXPECT_LT((imu->calibration.R_camera_imu * Vector3(1, 0, 0) - Vector3(-1, 0, 0)).norm(), 1e-12);
    EXPECT_LT((imu->calibration.R_camera_imu * Vector3(0, 1, 0) - Vector3(0, 0, -1)).norm(), 1e-12);
  }
}

TEST(ReadImu, TakesTheYamlOfTheSameName) {
  TemporaryFolder folder;
  write_text(folder.path() / "imu.csv", kSamples);
  write_text(folder.path() / "imu.yaml", imu_sensor());
  EXPECT_TRUE(read_imu(folder.path().string(), {}).ok());
  EXPECT_TRUE(read_imu((folder.path() / "imu.csv").string(), {}).ok());
  EXPECT_EQ(find_imu(folder.path().string()), (folder.path() / "imu.csv").string());
}

TEST(ReadImu, MovesSamplesToTheCamerasClock) {
  TemporaryFolder folder;
  write_text(folder.path() / "imu.csv", "1000000000,0,0,0,0,0,0\n");
  write_text(folder.path() / "imu.yaml", imu_sensor("timeshift_cam_imu: 0.25\n"));
  EXPECT_EQ(read_imu(folder.path().string(), {})->samples.front().time_us, kRelativeTimeBaseUs + 750'000);
}

TEST(ReadImu, RefusesByNameAndNamesTheFile) {
  TemporaryFolder folder;
  const auto refused = [&](Reason reason, const char* file) {
    const auto imu = read_imu(folder.path().string(), {});
    EXPECT_EQ(imu.reason(), reason) << imu.status().to_string();
    EXPECT_NE(imu.status().message().find(file), std::string::npos) << imu.status().to_string();
  };
  refused(Reason::NO_SUCH_FILE, "imu.csv");
  write_text(folder.path() / "imu.csv", kSamples);
  refused(Reason::NO_SUCH_FILE, "imu.yaml");
  write_text(folder.path() / "imu.yaml", "T_BS: somewhere\n");
  refused(Reason::CORRUPT, "imu.yaml");
  write_text(folder.path() / "imu.yaml", imu_sensor());
  write_text(folder.path() / "imu.csv", "1,2,3\n");
  refused(Reason::CORRUPT, "imu.csv: line 1");
  EXPECT_EQ(read_imu((folder.path() / "none.csv").string(), {}).reason(), Reason::NO_SUCH_FILE);
}

}  // namespace
}  // namespace relmap::capture
