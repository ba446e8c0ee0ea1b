#include <gtest/gtest.h>

#include "frontend/capture/imu_file.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

namespace fs = std::filesystem;

using testing_files::noise;
using testing_files::TemporaryFolder;
using testing_files::write_picture;
using testing_files::write_text;

std::string camera_sensor(const std::string& x) {
  return "%YAML:1.0\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0, -1, 0, 0.0,\n 1, 0, 0, " + x +
         ",\n 0, 0, 1, 0,\n 0, 0, 0, 1]\nresolution: [160, 120]\ncamera_model: pinhole\n"
         "intrinsics: [100, 100, 79.5, 59.5]\ndistortion_model: radial-tangential\n"
         "distortion_coefficients: [-0.1, 0.01, 0, 0]\n";
}

// Pictures of the right eye come `late` nanoseconds after those of the left.
void write_euroc(const fs::path& root, const std::vector<std::int64_t>& left, const std::vector<std::int64_t>& right,
                 std::int64_t late = 0) {
  for (const bool is_left : {true, false}) {
    const fs::path camera = root / (is_left ? "cam0" : "cam1");
    std::string csv = "#timestamp [ns],filename\r\n";
    for (const std::int64_t time : is_left ? left : right) {
      const std::string stamp = std::to_string(time + (is_left ? 0 : late));
      csv += stamp + ',' + stamp + ".png\r\n";
      write_picture(camera / "data" / (stamp + ".png"), noise(160, 120, CV_8UC1, is_left));
    }
    write_text(camera / "data.csv", csv);
    write_text(camera / "sensor.yaml", camera_sensor(is_left ? "0.0" : "0.11"));
  }
}

constexpr std::int64_t kBegin = 1'403'715'273'262'142'976, kStep = 50'000'000;

TEST(EurocSource, GivesRawPairsAndWhatRectifiesThem) {
  TemporaryFolder folder;
  write_euroc(folder.path() / "mav0", {kBegin, kBegin + kStep}, {kBegin, kBegin + kStep});
  for (const fs::path& path : {folder.path(), folder.path() / "mav0"}) {
    auto source = open_euroc(path.string());
    ASSERT_TRUE(source.ok()) << source.status().to_string();
    EXPECT_EQ((*source)->count(), 2u);
    EXPECT_EQ((*source)->skipped(), 0u);
    EXPECT_NEAR((*source)->camera().baseline, 0.11, 1e-9);
    EXPECT_NEAR((*source)->calibration().T_body_left.R(1, 0), 1, 1e-12);
    auto frame = (*source)->next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    EXPECT_EQ((*frame)->time_us, kBegin / 1000);
    EXPECT_EQ((*frame)->left.at(3, 4), noise(160, 120, CV_8UC1, 1).at<std::uint8_t>(4, 3));
    EXPECT_EQ((*frame)->right.at(3, 4), noise(160, 120, CV_8UC1, 0).at<std::uint8_t>(4, 3));
    const auto left = (*source)->rectifier().left((*frame)->left),
               right = (*source)->rectifier().right((*frame)->right);
    const auto both = rectify((*source)->rectifier(), std::move(**frame));
    ASSERT_TRUE(both.ok());
    EXPECT_EQ(both->left.at(30, 40), left->at(30, 40));
    EXPECT_EQ(both->right.at(30, 40), right->at(30, 40));
  }
}

TEST(EurocSource, OneEyeIsRectifiedAlone) {
  TemporaryFolder folder;
  write_euroc(folder.path(), {kBegin, kBegin + kStep}, {kBegin, kBegin + kStep});
  fs::remove(folder.path() / "cam0" / "data" / (std::to_string(kBegin) + ".png"));
  auto source = open_euroc(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  auto frame = (*source)->next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->eye_missing.reason(), Reason::NO_SUCH_FILE);
  const auto right = (*source)->rectifier().right((*frame)->right);
  const auto one = rectify((*source)->rectifier(), std::move(**frame));
  ASSERT_TRUE(one.ok()) << one.status().to_string();
  EXPECT_TRUE(one->left.empty());
  EXPECT_EQ(one->right.at(30, 40), right->at(30, 40));
}

TEST(EurocSource, PairsWhatIsOneMillisecondApart) {
  TemporaryFolder folder;
  write_euroc(folder.path(), {kBegin, kBegin + kStep}, {kBegin, kBegin + kStep}, 990'000);
  EXPECT_EQ((*open_euroc(folder.path().string()))->count(), 2u);
  TemporaryFolder later;
  write_euroc(later.path(), {kBegin, kBegin + kStep}, {kBegin, kBegin + kStep}, 1'002'000);
  EXPECT_EQ(open_euroc(later.path().string()).reason(), Reason::NO_SUCH_FILE);
}

TEST(EurocSource, CountsPicturesWithoutTheirOtherEye) {
  TemporaryFolder folder;
  write_euroc(folder.path(), {kBegin, kBegin + kStep, kBegin + 3 * kStep},
              {kBegin, kBegin + 2 * kStep, kBegin + 3 * kStep});
  auto source = open_euroc(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->count(), 2u);
  EXPECT_EQ((*source)->skipped(), 2u);
  const std::string first = "cam0/data/" + std::to_string(kBegin + kStep) + ".png";
  EXPECT_NE((*source)->describe().find(first), std::string::npos) << (*source)->describe();
  EXPECT_EQ((*(*source)->next())->time_us, kBegin / 1000);
  EXPECT_EQ((*(*source)->next())->time_us, (kBegin + 3 * kStep) / 1000);
}

TEST(EurocSource, TakesPicturesNamedByNanoseconds) {
  TemporaryFolder folder;
  // Of a simulation that begins at zero: not in the order of their names.
  for (const char* name : {"50000000.png", "100000000.png", "0.png"})
    for (const char* eye : {"cam0", "cam1"}) write_picture(folder.path() / eye / name, noise(160, 120, CV_8UC1, 1));
  write_text(folder.path() / "cam0_sensor.yaml", camera_sensor("0.0"));
  write_text(folder.path() / "cam1_sensor.yaml", camera_sensor("0.11"));
  auto source = open_euroc(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  for (int i = 0; i < 3; ++i) EXPECT_EQ((*(*source)->next())->time_us, kRelativeTimeBaseUs + i * 50'000);
  write_picture(folder.path() / "cam1" / "last.png", noise(160, 120, CV_8UC1, 1));
  const auto bad = open_euroc(folder.path().string());
  EXPECT_EQ(bad.reason(), Reason::CORRUPT);
  EXPECT_NE(bad.status().message().find("last.png"), std::string::npos);
}

TEST(EurocSource, OfOneCameraIsOfOneEye) {
  TemporaryFolder folder;
  write_euroc(folder.path(), {kBegin}, {kBegin});
  fs::remove_all(folder.path() / "cam1");
  auto source = open_euroc(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->camera().baseline, 0);
  const auto frame = rectify((*source)->rectifier(), std::move(**(*source)->next()));
  ASSERT_TRUE(frame.ok()) << frame.status().to_string();
  EXPECT_FALSE(frame->left.empty());
  EXPECT_TRUE(frame->right.empty());
}

TEST(EurocSource, FindsWhatItsInertialUnitSaid) {
  TemporaryFolder folder;
  write_euroc(folder.path() / "mav0", {kBegin}, {kBegin});
  EXPECT_EQ((*open_euroc(folder.path().string()))->imu(), "");
  write_text(folder.path() / "mav0/imu0/data.csv", "#timestamp\n1403715273262142976,0,0,1,0,9.81,0\n");
  write_text(folder.path() / "mav0/imu0/sensor.yaml",
             "T_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
             "gyroscope_noise_density: 1e-4\ngyroscope_random_walk: 1e-5\n");
  for (const fs::path& path : {folder.path(), folder.path() / "mav0"}) {
    const auto source = open_euroc(path.string());
    ASSERT_TRUE(source.ok());
    const auto imu = read_imu((*source)->imu(), (*source)->calibration().T_body_left);
    ASSERT_TRUE(imu.ok()) << imu.status().to_string();
    EXPECT_EQ(imu->samples.front().time_us, kBegin / 1000);
    // The body's y, up against gravity, is the camera's x.
    EXPECT_LT((imu->calibration.R_camera_imu * imu->samples.front().acceleration - Vector3(9.81, 0, 0)).norm(), 1e-9);
  }
}

TEST(EurocSource, RefusesByName) {
  TemporaryFolder folder;
  EXPECT_EQ(open_euroc(folder.path().string()).reason(), Reason::NO_SUCH_FILE);
  write_euroc(folder.path(), {kBegin, kBegin - kStep}, {kBegin, kBegin + kStep});
  const auto backwards = open_euroc(folder.path().string());
  EXPECT_EQ(backwards.reason(), Reason::TIME_BACKWARDS);
  EXPECT_NE(backwards.status().message().find("cam0/data.csv: line 3"), std::string::npos);
  write_text(folder.path() / "cam0/data.csv", "1403715273262142976\n");
  EXPECT_EQ(open_euroc(folder.path().string()).reason(), Reason::CORRUPT);
  write_text(folder.path() / "cam0/data.csv", "#timestamp [ns],filename\n");
  EXPECT_EQ(open_euroc(folder.path().string()).reason(), Reason::BAD_SIZE);
}

}  // namespace
}  // namespace relmap::capture
