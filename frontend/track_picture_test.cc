#include "frontend/track_picture.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "frontend/track_show.h"

namespace relmap {
namespace {

TrackedPair pair_of(int width, int height) {
  auto pair = std::make_shared<Pair>();
  pair->picture = Image(width, height);
  std::fill_n(pair->picture.row(0), width * height, std::uint8_t{100});
  TrackedPair tracked;
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
  const ColourPicture small = draw_tracks(pair_of(301, 201), 0), large = draw_tracks(pair_of(1242, 375), 0);
  EXPECT_EQ(small.width, 904);
  EXPECT_EQ(large.width, 1242);
  for (const ColourPicture* picture : {&small, &large}) {
    EXPECT_EQ(picture->width % 2, 0);
    EXPECT_EQ(picture->height % 2, 0);
    EXPECT_EQ(picture->bgr.size(), static_cast<std::size_t>(3 * picture->width * picture->height));
  }
}

TEST(TrackPicture, YoungLandmarksAreBlueAndOldOnesRed) {
  TrackedPair pair = pair_of(1000, 400);
  pair.report.tracks = {{.u = 200, .v = 200, .age = 0, .inlier = true},
                        {.u = 400, .v = 200, .age = 16, .inlier = true}};
  const ColourPicture picture = draw_tracks(pair, 7);
  EXPECT_GT(at(picture, 200, 200).blue, at(picture, 200, 200).red + 50);
  EXPECT_GT(at(picture, 400, 200).red, at(picture, 400, 200).blue + 50);
  const Colour nothing = at(picture, 600, 200);
  EXPECT_EQ(nothing.blue, nothing.red);
}

TEST(TrackPicture, LostPairsHaveARedFrame) {
  TrackedPair pair = pair_of(1000, 400);
  EXPECT_EQ(at(draw_tracks(pair, 0), 1, 200).red, at(draw_tracks(pair, 0), 1, 200).blue);
  pair.report.tracked = false;
  EXPECT_GT(at(draw_tracks(pair, 0), 1, 200).red, 200);
}

TEST(TrackShow, WritesPicturesIntoAFolder) {
  const std::string folder = ::testing::TempDir() + "relmap_track_show_test";
  auto show = open_track_show(folder, 10).or_throw();
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(show->show(draw_tracks(pair_of(100, 80), i)).ok());
  EXPECT_TRUE(show->close().ok());
  EXPECT_TRUE(std::filesystem::exists(folder + "/000000.png"));
  EXPECT_TRUE(std::filesystem::exists(folder + "/000001.png"));
  std::filesystem::remove_all(folder);
}

TEST(TrackShow, SaysWhereItCannotBeWritten) {
  EXPECT_EQ(open_track_show("/proc/nowhere", 10).reason(), Reason::IO_ERROR);
  EXPECT_EQ(open_track_show("/nowhere/out.mp4", 10).reason(), Reason::IO_ERROR);
}

}  // namespace
}  // namespace relmap
