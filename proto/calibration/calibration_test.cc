#include "proto/calibration/calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

namespace relmap {
namespace {

const std::string kKittiRow0 = "P0: 721.5377 0 609.5593 0 0 721.5377 172.854 0 0 0 1 0\n";
const std::string kKittiRow1 = "P1: 721.5377 0 609.5593 -387.5744 0 721.5377 172.854 0 0 0 1 0\n";

std::string euroc(const std::string& translation_x, const std::string& more = "") {
  return "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, " + translation_x +
         ",\n 0, 1, 0, 0.01,\n 0, 0, 1, 0,\n 0, 0, 0, 1]\nresolution: [752, 480]\n"
         "camera_model: pinhole\nintrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv\n"
         "distortion_model: radial-tangential\n"
         "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n" +
         more;
}

std::string matrix(const std::string& name, int rows, int columns, const std::string& data) {
  return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) + "\n   cols: " + std::to_string(columns) +
         "\n   dt: d\n   data: [ " + data + " ]\n";
}

const std::string kM1 = matrix("M1", 3, 3, "534., 0., 341.5, 0., 534.5, 233.6, 0., 0., 1.");
const std::string kD1 = matrix("D1", 1, 5, "-2.7e-01, -4.0e-02, 1.0e-03, -3.0e-04, 2.5e-01");
const std::string kM2 = matrix("M2", 3, 3, "537., 0., 326.7, 0., 537.1, 248.7, 0., 0., 1.");
const std::string kD2 = matrix("D2", 1, 5, "-2.9e-01, 1.1e-01, 0., 0., 0.");
const std::string kR = matrix("R", 3, 3, "1., 0., 0., 0., 9.9995e-01, -9.9998e-03, 0., 9.9998e-03, 9.9995e-01");
const std::string kT = matrix("T", 3, 1, "-0.12, 0.001, 0.002");
const std::string kOpenCv = "%YAML:1.0\n---\n" + kM1 + kD1 + kM2 + kD2 + kR + kT + "imageSize: [ 640, 480 ]\n";

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

TEST(KittiCalibration, GivesTheRectifiedCamera) {
  auto c = parse_kitti_calibration(kKittiRow0 + kKittiRow1 + "P2: x\n");
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_TRUE(c->rectified);
  EXPECT_EQ(c->width, 0);
  c->width = 1242;
  c->height = 375;
  const StereoCamera camera = c->rectified_camera();
  EXPECT_NEAR(camera.baseline, 0.53715, 1e-5);
  EXPECT_EQ(camera.f, 721.5377);
  EXPECT_EQ(camera.cx, 609.5593);
  EXPECT_TRUE(camera.check_plausible().ok());
}

TEST(KittiCalibration, RawDataSetsHaveOtherMatrixNamesAndASize) {
  const auto c =
      parse_kitti_calibration("S_rect_00: 1.242000e+03 3.750000e+02\r\n" + replaced(kKittiRow0, "P0", "P_rect_00") +
                              replaced(kKittiRow1, "P1", "P_rect_01"));
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_EQ(c->width, 1242);
  EXPECT_EQ(c->height, 375);
}

TEST(KittiCalibration, OneCameraIsMono) {
  const auto c = parse_kitti_calibration(kKittiRow0);
  ASSERT_TRUE(c.ok());
  EXPECT_TRUE(c->mono());
  EXPECT_EQ(c->rectified_camera().baseline, 0);
}

TEST(KittiCalibration, BadTextIsRefusedWithItsReason) {
  EXPECT_EQ(parse_kitti_calibration("").reason(), Reason::CORRUPT);
  EXPECT_EQ(parse_kitti_calibration("P0: 1 2 3\n").reason(), Reason::CORRUPT);
  EXPECT_EQ(parse_kitti_calibration("P0: a b c\n").reason(), Reason::CORRUPT);
  EXPECT_EQ(parse_kitti_calibration(replaced(kKittiRow0, "0 0 1 0", "0.5 0 1 0")).reason(), Reason::CORRUPT);
  const auto swapped = replaced(kKittiRow0, "P0", "P1") + replaced(kKittiRow1, "P1", "P0");
  EXPECT_EQ(parse_kitti_calibration(swapped).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(parse_kitti_calibration(kKittiRow0 + replaced(kKittiRow1, "172.854", "180")).reason(),
            Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(parse_kitti_calibration(kKittiRow0 + kKittiRow1 + "S_rect_00: nan 1\n").reason(),
            Reason::IMPLAUSIBLE_CALIBRATION);
}

TEST(OpenCvCalibration, GivesBothCamerasAndTheTransformBetweenThem) {
  const auto c = parse_opencv_calibration(kOpenCv);
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_FALSE(c->rectified);
  EXPECT_EQ(c->left, (RawCamera{534, 534.5, 341.5, 233.6, -0.27, -0.04, 1e-3, -3e-4, 0.25}));
  EXPECT_EQ(c->right.k2, 0.11);
  EXPECT_EQ(c->T_right_left.t, Vector3(-0.12, 0.001, 0.002));
  EXPECT_NEAR(c->T_right_left.R(2, 1), 0.01, 1e-5);
  EXPECT_LT((c->T_right_left.R * c->T_right_left.R.transpose() - Matrix3::Identity()).norm(), 1e-14);
  EXPECT_EQ(c->width, 640);
  EXPECT_EQ(c->height, 480);
}

TEST(OpenCvCalibration, TheSizeMayBeTwoNumbersOrMissing) {
  const auto c =
      parse_opencv_calibration(replaced(kOpenCv, "imageSize: [ 640, 480 ]", "image_width: 640\nimage_height: 480"));
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_EQ(c->height, 480);
  const auto without = parse_opencv_calibration(replaced(kOpenCv, "imageSize: [ 640, 480 ]", ""));
  ASSERT_TRUE(without.ok());
  EXPECT_EQ(without->width, 0);
}

struct BadCalibration {
  const char* name;
  Reason reason;
  std::string what, with;
};

class RefusedCalibration : public ::testing::TestWithParam<BadCalibration> {};

TEST_P(RefusedCalibration, IsRefusedWithItsReason) {
  const auto c = parse_opencv_calibration(replaced(kOpenCv, GetParam().what, GetParam().with));
  ASSERT_FALSE(c.ok());
  EXPECT_EQ(c.reason(), GetParam().reason) << c.status().to_string();
}

std::string bad_calibration_name(const ::testing::TestParamInfo<BadCalibration>& bad) { return bad.param.name; }

INSTANTIATE_TEST_SUITE_P(
    OpenCv, RefusedCalibration,
    ::testing::Values(
        BadCalibration{"NotANumber", Reason::CORRUPT, "534.5", "f"},
        BadCalibration{"NaN", Reason::IMPLAUSIBLE_CALIBRATION, "341.5", ".nan"},
        BadCalibration{"UnequalFocalLengths", Reason::IMPLAUSIBLE_CALIBRATION, "534.5", "834.5"},
        BadCalibration{"NegativeFocalLength", Reason::IMPLAUSIBLE_CALIBRATION, "534., 0.", "-534., 0."},
        BadCalibration{"FocalLengthOfNoPicture", Reason::IMPLAUSIBLE_CALIBRATION, "[ 640, 480 ]", "[ 16000, 480 ]"},
        BadCalibration{"PrincipalPointOutside", Reason::IMPLAUSIBLE_CALIBRATION, "341.5", "741.5"},
        BadCalibration{"Folded", Reason::IMPLAUSIBLE_CALIBRATION, "-2.9e-01, 1.1e-01", "-0.9, 0"},
        BadCalibration{"Tangential", Reason::IMPLAUSIBLE_CALIBRATION, "1.0e-03", "0.3"},
        BadCalibration{"MoreCoefficients", Reason::UNSUPPORTED, "2.5e-01", "0.25, 0.1, 0.1, 0.1"},
        BadCalibration{"Millimetres", Reason::IMPLAUSIBLE_CALIBRATION, "-0.12", "-120"},
        BadCalibration{"EyesSwapped", Reason::IMPLAUSIBLE_CALIBRATION, "-0.12", "0.12"},
        BadCalibration{"Upright", Reason::IMPLAUSIBLE_CALIBRATION, "-0.12, 0.001", "0.0, -0.12"},
        BadCalibration{"NoRotation", Reason::IMPLAUSIBLE_CALIBRATION, "9.9995e-01", "2"},
        BadCalibration{"EyesTurned", Reason::IMPLAUSIBLE_CALIBRATION,
                       "9.9995e-01, -9.9998e-03, 0., 9.9998e-03, 9.9995e-01", "0.8, -0.6, 0., 0.6, 0.8"},
        BadCalibration{"NoTransform", Reason::CORRUPT, "R: !!", "Q: !!"},
        BadCalibration{"NoCamera", Reason::CORRUPT, "M1: !!", "X1: !!"},
        BadCalibration{"TooFewNumbers", Reason::CORRUPT, "534., 0.,", "534.,"},
        BadCalibration{"NegativeSize", Reason::IMPLAUSIBLE_CALIBRATION, "[ 640,", "[ -640,"},
        BadCalibration{"NotYaml", Reason::CORRUPT, "M1: !!opencv-matrix", "M1: [ { ]"},
        BadCalibration{"CutShort", Reason::CORRUPT, "data: [ -0.12, 0.001, 0.002 ]", "data: [ -0.12, 0.0"}),
    bad_calibration_name);

TEST(EurocCalibration, GivesTheTransformFromTheBodyFrames) {
  const auto c = parse_euroc_calibration(euroc("0.02"), euroc("0.13"));
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_NEAR(c->T_right_left.t.x(), -0.11, 1e-12);
  EXPECT_EQ(c->left.fy, 457.296);
  EXPECT_EQ(c->left.p1, 0.00019359);
  EXPECT_EQ(c->left.k3, 0);
  EXPECT_EQ(c->width, 752);
}

TEST(EurocCalibration, GivesThePoseOfTheLeftCameraInTheBody) {
  const std::string turned = "[0, -1, 0, 0.02,\n 1, 0, 0, 0.01,\n 0, 0, 1, 0,";
  const std::string left = replaced(euroc("0.02"), "[1, 0, 0, 0.02,\n 0, 1, 0, 0.01,\n 0, 0, 1, 0,", turned);
  const auto c = parse_euroc_calibration(left);
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_LT((c->T_body_left * Vector3(1, 0, 0) - Vector3(0.02, 1.01, 0)).norm(), 1e-12);
  EXPECT_TRUE(parse_kitti_calibration(kKittiRow0)->T_body_left.R.isIdentity());
}

TEST(EurocCalibration, OneCameraIsMono) {
  const auto c = parse_euroc_calibration(euroc("0.02"));
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_TRUE(c->mono());
  EXPECT_EQ(c->left, parse_euroc_calibration(euroc("0.02"), euroc("0.13"))->left);
  EXPECT_EQ(c->width, 752);
}

TEST(EurocCalibration, BadTextIsRefusedWithItsReason) {
  const auto left = euroc("0.02"), right = euroc("0.13");
  EXPECT_EQ(parse_euroc_calibration(left, "").reason(), Reason::CORRUPT);
  EXPECT_EQ(parse_euroc_calibration(right, left).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(parse_euroc_calibration(replaced(left, "pinhole", "omni"), right).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(parse_euroc_calibration(replaced(left, "radial-tangential", "equidistant"), right).reason(),
            Reason::UNSUPPORTED);
  EXPECT_EQ(parse_euroc_calibration(replaced(left, "752", "640"), right).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(parse_euroc_calibration(replaced(left, "T_BS", "T_SB"), right).reason(), Reason::CORRUPT);
}

std::string kalibr_camera(const std::string& more, const std::string& lens = "radtan") {
  return "  cam_overlaps: [1]\n  camera_model: pinhole\n"
         "  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n  distortion_model: " +
         lens + "\n  intrinsics: [458.654, 457.296, 367.215, 248.375]\n  resolution: [752, 480]\n" + more;
}

const std::string kKalibrRight =
    "  T_cn_cnm1:\n  - [0.9999, 0.0, 0.014142, -0.11]\n  - [0.0, 1.0, 0.0, 0.001]\n"
    "  - [-0.014142, 0.0, 0.9999, 0.002]\n  - [0.0, 0.0, 0.0, 1.0]\n";
const std::string kKalibr = "cam0:\n" + kalibr_camera("  rostopic: /left\n") + "cam1:\n" + kalibr_camera(kKalibrRight);

TEST(KalibrCalibration, GivesBothCamerasAndTheTransformBetweenThem) {
  const auto c = parse_kalibr_calibration(kKalibr);
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_FALSE(c->rectified);
  EXPECT_EQ(c->left,
            (RawCamera{458.654, 457.296, 367.215, 248.375, -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}));
  EXPECT_EQ(c->right, c->left);
  EXPECT_EQ(c->T_right_left.t, Vector3(-0.11, 0.001, 0.002));
  EXPECT_NEAR(c->T_right_left.R(0, 2), 0.014142, 1e-5);
  EXPECT_TRUE(c->T_body_left.R.isIdentity());
  EXPECT_EQ(c->width, 752);
  EXPECT_EQ(c->height, 480);
}

TEST(KalibrCalibration, TheBodyIsTheInertialUnit) {
  const std::string pose = "  T_cam_imu:\n  - [0, 1, 0, 0.5]\n  - [-1, 0, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n";
  const auto c = parse_kalibr_calibration("cam0:\n" + kalibr_camera(pose));
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_TRUE(c->mono());
  // The point (1, 0, 0) of the inertial unit is at (0.5, -1, 0) in the camera.
  EXPECT_LT((c->T_body_left * Vector3(0.5, -1, 0) - Vector3(1, 0, 0)).norm(), 1e-12);
}

TEST(KalibrCalibration, MayBeWithoutDistortion) {
  const auto c = parse_kalibr_calibration(
      replaced("cam0:\n" + kalibr_camera("", "none"), "[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]", "[]"));
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_EQ(c->left, (RawCamera{458.654, 457.296, 367.215, 248.375}));
}

TEST(KalibrCalibration, BadTextIsRefusedWithItsReason) {
  const auto reason = [](const std::string& text) { return parse_kalibr_calibration(text).reason(); };
  EXPECT_EQ(reason("cam1:\n" + kalibr_camera(kKalibrRight)), Reason::CORRUPT);
  EXPECT_EQ(reason(replaced(kKalibr, "pinhole", "omni")), Reason::UNSUPPORTED);
  const auto fisheye = parse_kalibr_calibration(replaced(kKalibr, "radtan", "equidistant"));
  EXPECT_EQ(fisheye.reason(), Reason::UNSUPPORTED);
  EXPECT_NE(fisheye.status().message().find("equidistant"), std::string::npos);
  EXPECT_EQ(reason(replaced(kKalibr, "T_cn_cnm1", "T_other")), Reason::CORRUPT);
  EXPECT_EQ(reason(replaced(kKalibr, "- [0.0, 0.0, 0.0, 1.0]", "")), Reason::CORRUPT);
  EXPECT_EQ(reason(replaced(kKalibr, "-0.11", "0.11")), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(reason(replaced(kKalibr, "-0.11", "-110")), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(reason(replaced(kKalibr, "1.0, 0.0, 0.001", "2.0, 0.0, 0.001")), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(reason(replaced(kKalibr, "[752, 480]", "[640, 480]")), Reason::IMPLAUSIBLE_CALIBRATION);
}

std::string ros_matrix(const std::string& name, const std::string& data) {
  return name + ":\n  rows: 3\n  cols: 3\n  data: [" + data + "]\n";
}

// An eye that is turned by `angle` radians about y relative to the rectified camera.
std::string ros(double angle, const std::string& tx, const std::string& distortion = "-0.35, 0.15, 0.001, 0.0, 0.0") {
  const std::string c = std::to_string(std::cos(angle)), s = std::to_string(std::sin(angle)),
                    minus_s = std::to_string(-std::sin(angle));
  return "image_width: 640\nimage_height: 480\ncamera_name: bumblebee\n" +
         ros_matrix("camera_matrix", "500.0, 0, 320.0, 0, 501.0, 240.0, 0, 0, 1") + "distortion_model: plumb_bob\n" +
         ros_matrix("distortion_coefficients", distortion) +
         ros_matrix("rectification_matrix", c + ", 0, " + s + ", 0, 1, 0, " + minus_s + ", 0, " + c) +
         ros_matrix("projection_matrix", "450.0, 0, 310.0, " + tx + ", 0, 450.0, 235.0, 0, 0, 0, 1, 0");
}

const std::string kRosLeft = ros(0.02, "0.0"), kRosRight = ros(-0.01, "-54.0");

TEST(RosCalibration, TheTransformFollowsFromTheRectification) {
  const auto c = parse_ros_calibration(kRosLeft, kRosRight);
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_FALSE(c->rectified);
  EXPECT_EQ(c->left, (RawCamera{500, 501, 320, 240, -0.35, 0.15, 0.001}));
  EXPECT_EQ(c->width, 640);
  // After rectification, points are 54 / 450 m further to the left in the right eye.
  const auto turn = [](double angle) { return so3_exp({0, angle, 0}); };
  const Vector3 p(0.3, -0.2, 2);
  const Vector3 right = turn(-0.01).transpose() * (turn(0.02) * p + Vector3(-0.12, 0, 0));
  EXPECT_LT((c->T_right_left * p - right).norm(), 1e-5);
}

TEST(RosCalibration, OneCameraIsMono) {
  const auto c = parse_ros_calibration(kRosLeft);
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_TRUE(c->mono());
}

TEST(RosCalibration, RecognisesPicturesThatAreRectifiedAlready) {
  const auto plain = [](const std::string& tx) {
    return replaced(ros(0, tx, "0, 0, 0, 0, 0"), "500.0, 0, 320.0, 0, 501.0, 240.0",
                    "450.0, 0, 310.0, 0, 450.0, 235.0");
  };
  const auto c = parse_ros_calibration(plain("0.0"), plain("-54.0"));
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_TRUE(c->rectified);
  EXPECT_NEAR(c->rectified_camera().baseline, 0.12, 1e-12);
}

TEST(RosCalibration, BadTextIsRefusedWithItsReason) {
  const auto reason = [](const std::string& left, const std::string& right) {
    return parse_ros_calibration(left, right).reason();
  };
  EXPECT_EQ(reason(kRosRight, kRosLeft), Reason::IMPLAUSIBLE_CALIBRATION);  // exchanged
  EXPECT_EQ(reason(kRosLeft, kRosLeft), Reason::IMPLAUSIBLE_CALIBRATION);   // no baseline
  EXPECT_EQ(reason(kRosLeft, replaced(kRosRight, "640", "800")), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(reason(replaced(kRosLeft, "450.0", "0.0"), kRosRight), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(reason(replaced(kRosLeft, "plumb_bob", "equidistant"), kRosRight), Reason::UNSUPPORTED);
  EXPECT_EQ(reason(replaced(kRosLeft, "0.001, 0.0, 0.0", "0.001, 0.0, 0.0, 0.5, 0, 0"), kRosRight),
            Reason::UNSUPPORTED);
  EXPECT_EQ(reason(replaced(kRosLeft, "projection_matrix", "p"), kRosRight), Reason::CORRUPT);
  EXPECT_EQ(reason(replaced(kRosLeft, "0, 0, 0, 1, 0", "0, 0, 0, 2, 0"), kRosRight), Reason::CORRUPT);
  EXPECT_EQ(reason(replaced(kRosLeft, "0, 1, 0, ", "0, 3, 0, "), kRosRight), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(reason(replaced(kRosLeft, "image_width", "w"), kRosRight), Reason::CORRUPT);
}

class LoadCalibration : public ::testing::Test {
 protected:
  LoadCalibration()
      : folder_(std::filesystem::temp_directory_path() / ("relmap_calibration_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~LoadCalibration() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    const auto path = folder_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
    return path.string();
  }
  std::filesystem::path folder_;
};

TEST_F(LoadCalibration, TellsTheFormatsApart) {
  EXPECT_TRUE(load_calibration(write("a.yaml", kOpenCv)).ok());
  EXPECT_TRUE(load_calibration(write("calibration", kKittiRow0 + kKittiRow1)).ok());
  write("cam0/sensor.yaml", euroc("0.02"));
  const std::string right = write("cam1/sensor.yaml", euroc("0.13"));
  const auto c = load_calibration(right);
  ASSERT_TRUE(c.ok()) << c.status().to_string();
  EXPECT_NEAR(c->T_right_left.t.x(), -0.11, 1e-12);
}

TEST_F(LoadCalibration, Cam0OfEurocAloneIsMono) {
  EXPECT_TRUE(load_calibration(write("cam0/sensor.yaml", euroc("0.02")))->mono());
  EXPECT_TRUE(load_calibration(write("camera.yaml", euroc("0.02")))->mono());
  EXPECT_EQ(load_calibration(write("alone/cam1/sensor.yaml", euroc("0.13"))).reason(), Reason::NO_SUCH_FILE);
}

TEST_F(LoadCalibration, FindsItInADataSet) {
  EXPECT_EQ(load_calibration(folder_.string()).reason(), Reason::NO_SUCH_FILE);
  write("mav0/cam0/sensor.yaml", euroc("0.02"));
  write("mav0/cam1/sensor.yaml", euroc("0.13"));
  EXPECT_EQ(load_calibration(folder_.string())->width, 752);
  write("calib.txt", kKittiRow0 + kKittiRow1);
  EXPECT_TRUE(load_calibration(folder_.string())->rectified);
}

TEST_F(LoadCalibration, EitherFileOfRosLoadsBoth) {
  const std::string left = write("front_left.yaml", kRosLeft), right = write("front_right.yaml", kRosRight);
  for (const std::string& path : {left, right, folder_.string()}) {
    const auto c = load_calibration(path);
    ASSERT_TRUE(c.ok()) << c.status().to_string();
    EXPECT_NEAR(c->T_right_left.t.norm(), 0.12, 1e-5) << path;
  }
  EXPECT_TRUE(load_calibration(write("one/left.yaml", kRosLeft))->mono());
  EXPECT_TRUE(load_calibration(write("one/ost.yaml", kRosLeft))->mono());
  EXPECT_EQ(load_calibration(write("other/right.yaml", kRosRight)).reason(), Reason::NO_SUCH_FILE);
}

TEST_F(LoadCalibration, AFolderMayHoldOneCalibrationOfAnyName) {
  write("settings.yaml", "mode: format7.3\n");
  write("imu.yaml", "T_BS: [1, 0]\n");
  EXPECT_EQ(load_calibration(folder_.string()).reason(), Reason::NO_SUCH_FILE);
  write("rig-camchain.yaml", kKalibr);
  EXPECT_EQ(load_calibration(folder_.string())->width, 752);
  write("another.yml", kOpenCv);
  const auto several = load_calibration(folder_.string());
  EXPECT_EQ(several.reason(), Reason::INVALID_ARGUMENT);
  EXPECT_NE(several.status().message().find("rig-camchain.yaml"), std::string::npos);
  write("stereo.yaml", kOpenCv);  // a well-known name is preferred
  EXPECT_EQ(load_calibration(folder_.string())->width, 640);
}

TEST_F(LoadCalibration, NamesTheFileThatIsWrong) {
  EXPECT_EQ(load_calibration((folder_ / "none").string()).reason(), Reason::NO_SUCH_FILE);
  const std::string path = write("bad.yaml", "just text");
  const auto c = load_calibration(path);
  EXPECT_EQ(c.reason(), Reason::CORRUPT);
  EXPECT_NE(c.status().message().find(path), std::string::npos);
}

TEST(RectifiedCalibration, MustHaveParallelEyesWithoutDistortion) {
  StereoCalibration c = *parse_kitti_calibration(kKittiRow0 + kKittiRow1);
  ASSERT_TRUE(c.check_plausible().ok());
  StereoCalibration spoilt = c;
  spoilt.left.k1 = 0.1;
  EXPECT_EQ(spoilt.check_plausible().reason(), Reason::IMPLAUSIBLE_CALIBRATION);
  spoilt = c;
  spoilt.T_right_left.t.y() = 0.01;
  EXPECT_EQ(spoilt.check_plausible().reason(), Reason::IMPLAUSIBLE_CALIBRATION);
}

}  // namespace
}  // namespace relmap
