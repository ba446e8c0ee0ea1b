#include "tools/vocab/training_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "storage/testing/temporary_folder.h"

namespace relmap::vocab {
namespace {

// Noise, as a PGM file.
std::string write_picture(const std::string& folder, int width, int height) {
  const std::string path = folder + std::to_string(width) + ".pgm";
  std::ofstream out(path, std::ios::binary);
  out << "P5\n" << width << " " << height << "\n255\n";
  std::mt19937 random(1);
  for (int i = 0; i < width * height; ++i) out.put(static_cast<char>(random() & 255));
  return path;
}

bool same(const vision::Image& a, const vision::Image& b) {
  return a.width() == b.width() && a.height() == b.height() &&
         std::equal(a.row(0), a.row(0) + a.width() * a.height(), b.row(0));
}

TEST(TrainingViews, ASmallPictureIsItsOwnOnlyView) {
  const storage::TemporaryFolder folder;
  const auto views = training_views(write_picture(folder / "", 600, 300), 10).or_throw();
  ASSERT_EQ(views.size(), 1u);
  EXPECT_EQ(views[0].width(), 600);
  EXPECT_EQ(views[0].height(), 300);
}

TEST(TrainingViews, ALargePictureHasViewsByItsSizeAndAllDiffer) {
  const storage::TemporaryFolder folder;
  const std::string file = write_picture(folder / "", 1600, 1200);
  const auto views = training_views(file, 1000).or_throw();
  EXPECT_GT(views.size(), 10u);
  EXPECT_LT(views.size(), 40u);
  EXPECT_EQ(training_views(file, 7).or_throw().size(), 7u);
  for (std::size_t i = 0; i < views.size(); ++i) {
    EXPECT_EQ(views[i].width(), kViewWidth);
    EXPECT_EQ(views[i].height(), kViewHeight);
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(same(views[i], views[j]));
  }
}

TEST(TrainingViews, AreTheSameEachTime) {
  const storage::TemporaryFolder folder;
  const std::string file = write_picture(folder / "", 1600, 1200);
  const auto a = training_views(file, 5).or_throw(), b = training_views(file, 5).or_throw();
  for (std::size_t i = 0; i < 5; ++i) EXPECT_TRUE(same(a[i], b[i]));
}

TEST(TrainingViews, RefusesAFileThatIsNoPicture) {
  EXPECT_EQ(training_views("/nowhere.jpg", 5).reason(), Reason::NOT_A_PICTURE);
}

}  // namespace
}  // namespace relmap::vocab
