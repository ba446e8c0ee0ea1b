#include "frontend/track_picture.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "frontend/track_show.h"

namespace relmap::frontend {
namespace {

tracking::TrackedPair drawn_pair(int width, int height) {
  auto pair = std::make_shared<tracking::Pair>();
  pair->picture = vision::Image(width, height);
  std::fill_n(pair->picture.row(0), width * height, std::uint8_t{100});
  tracking::TrackedPair tracked;
  tracked.pair = std::move(pair);
  tracked.report.tracked = true;
  return tracked;
}

struct Colour {
  int blue, green, red;
};
Colour at(const ColourPicture& picture, int x, int y) {
  const auto* pixel = &picture.bgr[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + x)];
  return {pixel[0], pixel[1], pixel[2]};
}

TEST(TrackPicture, SmallPicturesAreEnlargedToEvenSizes) {
  const ColourPicture small = draw_tracks(drawn_pair(301, 201)), large = draw_tracks(drawn_pair(1242, 375));
  EXPECT_EQ(small.width, 904);
  EXPECT_EQ(large.width, 1242);
  for (const ColourPicture* picture : {&small, &large}) {
    EXPECT_EQ(picture->width % 2, 0);
    EXPECT_EQ(picture->height % 2, 0);
    EXPECT_EQ(picture->bgr.size(), static_cast<std::size_t>(3 * picture->width * picture->height));
  }
}

TEST(TrackPicture, YoungLandmarksAreBlueAndOldOnesRed) {
  tracking::TrackedPair pair = drawn_pair(1000, 400);
  pair.report.tracks = {{.u = 200, .v = 200, .age = 0, .inlier = true},
                        {.u = 400, .v = 200, .age = 16, .inlier = true}};
  const ColourPicture picture = draw_tracks(pair);
  EXPECT_GT(at(picture, 200, 200).blue, at(picture, 200, 200).red + 50);
  EXPECT_GT(at(picture, 400, 200).red, at(picture, 400, 200).blue + 50);
  const Colour nothing = at(picture, 600, 200);
  EXPECT_EQ(nothing.blue, nothing.red);
}

TEST(TrackPicture, LostPairsHaveARedFrame) {
  tracking::TrackedPair pair = drawn_pair(1000, 400);
  EXPECT_EQ(at(draw_tracks(pair), 1, 200).red, at(draw_tracks(pair), 1, 200).blue);
  pair.report.tracked = false;
  EXPECT_GT(at(draw_tracks(pair), 1, 200).red, 200);
}

TEST(TrackPicture, SaysWhichPairItIs) {
  tracking::TrackedPair pair = drawn_pair(1000, 400);
  pair.index = 1;
  const ColourPicture first = draw_tracks(pair);
  EXPECT_EQ(first.bgr, draw_tracks(pair).bgr);
  pair.index = 2;
  EXPECT_NE(first.bgr, draw_tracks(pair).bgr);
  pair.index = 1;
  pair.picture = "000001.png";
  EXPECT_NE(first.bgr, draw_tracks(pair).bgr);
  pair.picture.clear();
  pair.time_us = 1000;
  EXPECT_NE(first.bgr, draw_tracks(pair).bgr);
}

class ShownTracks : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return folder_ + '/' + name; }
  static void show(const std::string& path, bool goes_on, std::uint64_t index) {
    auto shown = open_track_show(path, 10, goes_on).or_throw();
    ASSERT_TRUE(shown->show(draw_tracks(drawn_pair(100, 80)), index).ok());
    ASSERT_TRUE(shown->close().ok());
  }
  static void expect_refused(const std::string& path, bool goes_on, Reason reason, const std::string& remedy) {
    const auto refused = open_track_show(path, 10, goes_on);
    EXPECT_EQ(refused.reason(), reason) << path;
    EXPECT_NE(refused.status().message().find(path), std::string::npos) << refused.status().to_string();
    EXPECT_NE(refused.status().message().find(remedy), std::string::npos) << refused.status().to_string();
  }

  // A folder for each test, since tests run in parallel.
  const std::string folder_ =
      ::testing::TempDir() + "relmap_" + ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(ShownTracks, NamesPicturesByTheirPairAndGoesOnAmongThem) {
  show(path("tracks"), false, 7);
  EXPECT_TRUE(std::filesystem::exists(path("tracks/000007.png")));
  expect_refused(path("tracks"), false, Reason::INVALID_ARGUMENT, "choose another");
  show(path("tracks"), true, 8);
  EXPECT_TRUE(std::filesystem::exists(path("tracks/000007.png")));
  EXPECT_TRUE(std::filesystem::exists(path("tracks/000008.png")));
}

TEST_F(ShownTracks, WritesAFilmWhateverTheCaseOfItsName) {
  show(path("tracks.MP4"), false, 0);
  EXPECT_TRUE(std::filesystem::is_regular_file(path("tracks.MP4")));
  const auto size = std::filesystem::file_size(path("tracks.MP4"));
  EXPECT_GT(size, 0u);
  expect_refused(path("tracks.MP4"), true, Reason::INVALID_ARGUMENT, "choose another");
  EXPECT_EQ(std::filesystem::file_size(path("tracks.MP4")), size);
  show(path("tracks.MP4"), false, 0);
  for (const char* other : {"tracks.avi", "tracks.MKV", "tracks.mov", "tracks.webm"}) {
    expect_refused(path(other), false, Reason::UNSUPPORTED, ".mp4");
    EXPECT_FALSE(std::filesystem::exists(path(other)));
  }
}

TEST_F(ShownTracks, SaysWhereItCannotBeWritten) {
  expect_refused("/proc/nowhere", false, Reason::IO_ERROR, "cannot be made");
  expect_refused("/nowhere/out.mp4", false, Reason::IO_ERROR, "No such file");
  std::filesystem::create_directories(path("folder.mp4"));
  expect_refused(path("folder.mp4"), false, Reason::IO_ERROR, "Is a directory");
  // Nothing is left if no picture was shown.
  ASSERT_TRUE(open_track_show(path("empty.mp4"), 10, false).or_throw()->close().ok());
  EXPECT_FALSE(std::filesystem::exists(path("empty.mp4")));
}

}  // namespace
}  // namespace relmap::frontend
