#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "frontend/capture/photograph_folder.h"
#include "frontend/capture/recording_identity.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/capture/testing/picture_files.h"
#include "proto/base/bytes.h"

namespace relmap::capture {
namespace {

using testing_files::kKittiCalibration;
using testing_files::noise;
using testing_files::TemporaryFolder;
using testing_files::with_focal_length;
using testing_files::write_picture;
using testing_files::write_text;

TEST(ImagesSource, PairsByNameOrByOrder) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kKittiCalibration);
  for (int i = 0; i < 2; ++i) {
    write_picture(folder.path() / "left" / ("left_" + std::to_string(i) + ".jpg"), noise(160, 120, CV_8UC1, i));
    write_picture(folder.path() / "right" / ("right_" + std::to_string(i) + ".JPG.jpg"), noise(160, 120, CV_8UC1, i));
  }
  auto source = open_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->count(), 2u);
  write_picture(folder.path() / "left" / "left_2.jpg", noise(160, 120, CV_8UC1, 7));
  EXPECT_EQ(open_images(folder.path().string()).reason(), Reason::NO_SUCH_FILE);
}

TEST(ImagesSource, ReadsTimesFromNames) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kKittiCalibration);
  for (const char* name : {"1403715273262142976.png", "1403715273362142976.png"})
    for (const char* eye : {"cam0", "cam1"}) write_picture(folder.path() / eye / name, noise(160, 120, CV_8UC1, 3));
  auto source = open_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*(*source)->next())->time_us, 1'403'715'273'262'142);
}

TEST(ImagesSource, TakesListsOfTimesAndNames) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kKittiCalibration);
  for (const char* name : {"a.pgm", "b.pgm", "c.pgm"})
    for (const char* eye : {"l", "r"}) write_picture(folder.path() / eye / name, noise(160, 120, CV_8UC1, name[0]));
  write_text(folder.path() / "left.txt", "# of the left eye\n0.05 l/c.pgm\n0.10 l/a.pgm\n0.15 l/b.pgm\n");
  write_text(folder.path() / "right.txt", "0.0504 r/c.pgm\n0.12 r/a.pgm\n0.1496 r/b.pgm\n");
  auto source = open_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->count(), 2u);
  EXPECT_EQ((*source)->skipped(), 2u);
  EXPECT_EQ((*source)->expected(), 4u) << "left at 0.10 s, right at 0.12 s";
  EXPECT_EQ((*source)->missing().count, 2u);
  EXPECT_EQ((*source)->missing().first[0], "the other eye of " + (folder.path() / "l/a.pgm").string());
  EXPECT_NE((*source)->describe().find("l/a.pgm"), std::string::npos) << (*source)->describe();
  const auto first = (*source)->next(), second = (*source)->next();
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ((*first)->time_us, kRelativeTimeBaseUs + 50'000);
  EXPECT_EQ((*first)->left.at(50, 50), noise(160, 120, CV_8UC1, 'c').at<std::uint8_t>(50, 50));
  EXPECT_EQ((*second)->time_us, kRelativeTimeBaseUs + 150'000);
  write_text(folder.path() / "right.txt", "0.0504 r/c.pgm\nsoon r/a.pgm\n");
  const auto bad = open_images(folder.path().string());
  EXPECT_EQ(bad.reason(), Reason::CORRUPT);
  EXPECT_NE(bad.status().message().find("right.txt: line 2"), std::string::npos) << bad.status().to_string();
}

// Of a folder on a network disk each picture costs a way there and back: a source that is opened for its first pairs
// does not ask for all of them.
TEST(ImagesSource, MissingPicturesAreLookedForOnlyWhenAskedFor) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kKittiCalibration);
  for (const char* name : {"a.pgm", "b.pgm", "c.pgm"})
    for (const char* eye : {"left", "right"})
      write_picture(folder.path() / eye / name, noise(160, 120, CV_8UC1, name[0]));
  auto source = open_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  std::filesystem::remove(folder.path() / "right/c.pgm");
  EXPECT_EQ((*source)->missing().count, 1u);
  std::filesystem::remove(folder.path() / "right/b.pgm");
  EXPECT_EQ((*source)->missing().count, 1u) << "once";
  EXPECT_EQ((*source)->describe().find("right/b.pgm"), std::string::npos);
}

TEST(ImagesSource, OfTumsColourIsOfOneEye) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kKittiCalibration);
  write_text(folder.path() / "rgb.txt", "1305031102.175304 rgb/1.png\n1305031102.211214 rgb/2.png\n");
  write_picture(folder.path() / "rgb" / "1.png", noise(160, 120, CV_8UC3, 1));
  auto source = open_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->camera().baseline, 0);
  const auto frame = (*source)->next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->time_us, 1'305'031'102'175'304);
  EXPECT_TRUE((*frame)->right.empty());
  EXPECT_EQ((*source)->next().reason(), Reason::NO_SUCH_FILE);
}

TEST(ImagesSource, TakesPicturesOfOneEye) {
  for (const char* place : {"", "left", "image_0", "cam0/data"}) {
    TemporaryFolder folder;
    write_text(folder.path() / "calib.txt", kKittiCalibration);
    for (const char* name : {"1.png", "2.png"})
      write_picture(folder.path() / place / name, noise(160, 120, CV_8UC1, 1));
    auto source = open_images(folder.path().string());
    ASSERT_TRUE(source.ok()) << place << ": " << source.status().to_string();
    EXPECT_EQ((*source)->count(), 2u);
    EXPECT_EQ((*source)->camera().baseline, 0);
  }
}

TEST(ImagesSource, RefusesByName) {
  TemporaryFolder folder;
  EXPECT_EQ(open_images((folder.path() / "nowhere").string()).reason(), Reason::NO_SUCH_FILE);
  const auto empty = open_images(folder.path().string());
  EXPECT_EQ(empty.reason(), Reason::NO_SUCH_FILE);
  EXPECT_NE(empty.status().message().find("left and right"), std::string::npos) << empty.status().to_string();
  write_picture(folder.path() / "left" / "1.tiff", noise(160, 120, CV_8UC1, 1));
  const auto tiff = open_images(folder.path().string());
  EXPECT_EQ(tiff.reason(), Reason::UNSUPPORTED);
  EXPECT_NE(tiff.status().message().find("1.tiff"), std::string::npos);
  write_picture(folder.path() / "left" / "1.png", noise(160, 120, CV_8UC1, 1));
  EXPECT_EQ(open_images(folder.path().string()).reason(), Reason::NO_SUCH_FILE);  // no calibration
}

TEST(MonoImages, NeedNoCalibrationAndAreReduced) {
  TemporaryFolder folder;
  write_picture(folder.path() / "b.jpg", noise(1607, 1201, CV_8UC3, 1));
  write_picture(folder.path() / "a.jpg", noise(1607, 1201, CV_8UC3, 2));
  auto source = open_mono_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  const StereoCamera& camera = (*source)->camera();
  EXPECT_EQ(camera.baseline, 0);
  EXPECT_TRUE(camera.check_plausible().ok());
  EXPECT_LE(camera.width * camera.height, 500'000);
  EXPECT_NEAR(camera.f, 1.2 * camera.width, 1);
  for (const char* said : {"2 pictures of one eye", "reduced from 1607 x 1201", "unknown calibration"})
    EXPECT_NE((*source)->describe().find(said), std::string::npos) << (*source)->describe();
  const auto frame = (*source)->next();
  ASSERT_TRUE(frame.ok() && frame->has_value()) << frame.status().to_string();
  EXPECT_EQ((*frame)->picture, "a.jpg");
  EXPECT_EQ((*frame)->left.width(), camera.width);
  EXPECT_EQ((*frame)->left.height(), camera.height);
}

TEST(MonoImages, AreRectifiedByTheirCalibration) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kKittiCalibration);
  write_picture(folder.path() / "left" / "0.png", noise(160, 120, CV_8UC1, 1));
  write_picture(folder.path() / "right" / "0.png", noise(160, 120, CV_8UC1, 2));
  auto source = open_mono_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->camera().f, 100);
  EXPECT_EQ((*source)->camera().baseline, 0);
  const auto frame = (*source)->next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_TRUE((*frame)->right.empty());
  EXPECT_EQ((*frame)->left.at(50, 50), noise(160, 120, CV_8UC1, 1).at<std::uint8_t>(50, 50));
  FolderOptions named;
  named.calibration = (folder.path() / "none.yaml").string();
  EXPECT_EQ(open_mono_images(folder.path().string(), named).reason(), Reason::NO_SUCH_FILE) << "asked for by name";
}

TEST(MonoImages, WhatIsNoPictureIsNamedAndPassedOver) {
  TemporaryFolder folder;
  EXPECT_EQ(open_mono_images(folder.path().string()).reason(), Reason::NO_SUCH_FILE);
  write_text(folder.path() / "0.jpg", "no picture");
  EXPECT_EQ(open_mono_images(folder.path().string()).reason(), Reason::NOT_A_PICTURE);
  write_picture(folder.path() / "1.jpg", noise(160, 120, CV_8UC1, 1));
  auto source = open_mono_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->next().reason(), Reason::NOT_A_PICTURE);
  EXPECT_TRUE((*source)->next()->has_value());
  EXPECT_FALSE((*source)->next()->has_value());
}

TEST(MonoImages, OfSeveralCamerasAreTakenByCamera) {
  TemporaryFolder folder;
  write_picture(folder.path() / "1.jpg", noise(160, 120, CV_8UC1, 1));
  for (const char* upright : {"2.jpg", "3.jpg"}) write_picture(folder.path() / upright, noise(120, 160, CV_8UC1, 1));
  const auto all = open_mono_images(folder.path().string());
  EXPECT_EQ(all.reason(), Reason::INVALID_ARGUMENT);
  for (const char* said : {"120x160 (2)", "160x120 (1)", "--camera"})
    EXPECT_NE(all.status().message().find(said), std::string::npos) << all.status().message();
  for (const auto& [name, pictures] : {std::pair{"120x160", 2}, std::pair{"160x120", 1}}) {
    FolderOptions options;
    options.camera = name;
    const auto source = open_mono_images(folder.path().string(), options);
    ASSERT_TRUE(source.ok()) << source.status().to_string();
    EXPECT_EQ((*source)->count(), static_cast<std::size_t>(pictures));
    for (int i = 0; i < pictures; ++i) EXPECT_TRUE((*source)->next()->has_value());
  }
  FolderOptions none;
  none.camera = "1x1";
  EXPECT_EQ(open_mono_images(folder.path().string(), none).reason(), Reason::INVALID_ARGUMENT);
  const auto listed = open_photographs(folder.path().string());
  ASSERT_TRUE(listed.ok() && listed->cameras.size() == 2);
  EXPECT_EQ(listed->cameras[0].name, "120x160");
  EXPECT_EQ(listed->cameras[0].pictures, 2u);
  ASSERT_TRUE(listed->cameras[1].source.ok());
  EXPECT_EQ((*listed->cameras[1].source)->count(), 1u);
}

TEST(MonoImages, OfOneSizeAndTwoFocalLengthsAreOfTwoCameras) {
  TemporaryFolder folder;
  Bytes jpeg;
  cv::imencode(".jpg", noise(360, 240, CV_8UC1, 1), jpeg);
  for (const auto& [name, millimetres] : {std::pair{"wide.jpg", 24}, std::pair{"long.jpg", 72}})
    write_text(folder.path() / name, with_focal_length(jpeg, static_cast<std::uint8_t>(millimetres)));
  FolderOptions options;
  options.camera = "360x240-24mm";
  const auto wide = open_mono_images(folder.path().string(), options);
  ASSERT_TRUE(wide.ok()) << wide.status().to_string();
  EXPECT_EQ((*wide)->count(), 1u);
  EXPECT_NEAR((*wide)->camera().f, 240, 1e-9);
  EXPECT_NE((*wide)->describe().find("240 px"), std::string::npos) << (*wide)->describe();
}

TEST(MonoImages, TheirCameraIsFoundBehindLongHeaders) {
  TemporaryFolder folder;
  Bytes jpeg;
  cv::imencode(".jpg", noise(360, 240, CV_8UC1, 1), jpeg);
  std::string file = with_focal_length(jpeg, 24);
  std::string segment("\xff\xe2\xff\xff", 4);  // 64 KB of a colour profile, say
  segment.resize(2 + 0xffff);
  for (int i = 0; i < 6; ++i) file.insert(2 + 2 + 52, segment);
  write_text(folder.path() / "1.jpg", file);
  const auto listed = open_photographs(folder.path().string());
  ASSERT_TRUE(listed.ok() && listed->cameras.size() == 1);
  EXPECT_EQ(listed->cameras[0].name, "360x240-24mm");
}

TEST(MonoImages, OfOneCameraDoNotDependOnPicturesOfOthers) {
  TemporaryFolder folder;
  for (const char* name : {"b.jpg", "c.jpg"}) write_picture(folder.path() / name, noise(160, 120, CV_8UC1, name[0]));
  const auto of_camera = [&](const std::string& name) {
    const auto listed = open_photographs(folder.path().string()).or_throw();
    for (const PhotographFolder::Camera& camera : listed.cameras)
      if (camera.name == name) return identity_of(**camera.source);
    return RecordingIdentity{};
  };
  const RecordingIdentity before = of_camera("160x120");
  write_picture(folder.path() / "a.jpg", noise(120, 160, CV_8UC1, 1));
  EXPECT_EQ(of_camera("160x120"), before);
  EXPECT_EQ(of_camera("120x160").count, 1u);
  write_picture(folder.path() / "bb.jpg", noise(160, 120, CV_8UC1, 5));
  EXPECT_EQ(of_camera("160x120").count, 3u);
  EXPECT_NE(of_camera("160x120").contents, before.contents);
}

TEST(MonoImages, WhatLiesBesideThemIsNamed) {
  TemporaryFolder folder;
  write_picture(folder.path() / "1.jpg", noise(160, 120, CV_8UC1, 1));
  write_text(folder.path() / "times.txt", "0\n");
  write_text(folder.path() / ".hidden", "");
  const auto plain = open_photographs(folder.path().string());
  ASSERT_TRUE(plain.ok()) << plain.status().to_string();
  EXPECT_TRUE(plain->passed_over.empty()) << plain->passed_over.describe();
  for (const char* other : {"2.HEIC", "3.bmp", "notes.txt", "z.mov"}) write_text(folder.path() / other, "no picture");
  write_picture(folder.path() / "north/1.jpg", noise(160, 120, CV_8UC1, 1));
  const auto listed = open_photographs(folder.path().string());
  ASSERT_TRUE(listed.ok()) << listed.status().to_string();
  ASSERT_EQ(listed->cameras.size(), 1u);
  EXPECT_EQ(listed->cameras[0].pictures, 1u);
  EXPECT_EQ(listed->passed_over.folders, std::vector<std::string>{"north"});
  EXPECT_EQ(listed->passed_over.files, (std::vector<std::string>{"2.HEIC", "3.bmp", "notes.txt", "z.mov"}));
  const std::string said = (*open_mono_images(folder.path().string()))->describe();
  EXPECT_NE(said.find("1 folder (north) and 4 files that are neither PNG nor JPEG nor PGM (2.HEIC, 3.bmp, notes.txt "
                      "and 1 more)"),
            std::string::npos)
      << said;
}

TEST(MonoImages, TheErrorForAFolderWithoutPicturesDoesNotMentionEyes) {
  TemporaryFolder folder;
  write_text(folder.path() / "1.BMP", "no picture");
  const auto bitmaps = open_mono_images(folder.path().string());
  EXPECT_EQ(bitmaps.reason(), Reason::UNSUPPORTED);
  EXPECT_NE(bitmaps.status().message().find("1.BMP"), std::string::npos) << bitmaps.status().message();
  EXPECT_EQ(bitmaps.status().message().find("right"), std::string::npos) << bitmaps.status().message();
  TemporaryFolder folders;
  write_picture(folders.path() / "north/1.jpg", noise(160, 120, CV_8UC1, 1));
  const auto deeper = open_mono_images(folders.path().string());
  EXPECT_EQ(deeper.reason(), Reason::NO_SUCH_FILE);
  EXPECT_NE(deeper.status().message().find("there are pictures in its folder north"), std::string::npos)
      << deeper.status().message();
  const auto file = open_mono_images((folders.path() / "north/1.jpg").string());
  EXPECT_EQ(file.reason(), Reason::NO_SUCH_FILE);
  EXPECT_NE(file.status().message().find("is a file"), std::string::npos) << file.status().message();
}

}  // namespace
}  // namespace relmap::capture
