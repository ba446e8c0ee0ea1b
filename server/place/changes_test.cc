#include "server/place/changes.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace relmap::place {
namespace {

constexpr StereoCamera kVgaRig{400, 319.5, 239.5, 0.12, 640, 480};

// `per_cell` landmarks in each cell, of which `share` are found; none in the first `changed` cells.
std::vector<SoughtLandmark> look(int per_cell, double share, std::size_t changed, std::size_t cells = kPictureCells) {
  std::mt19937 random(1);
  std::bernoulli_distribution found(share);
  std::vector<SoughtLandmark> sought;
  for (std::size_t cell = 0; cell < cells; ++cell)
    for (int n = 0; n < per_cell; ++n)
      sought.push_back({{40.0 + 80 * static_cast<double>(cell % kPictureColumns),
                         40.0 + 80 * static_cast<double>(cell / kPictureColumns)},
                        cell >= changed && found(random)});
  return sought;
}

TEST(Changes, CellsInWhichNothingIsFoundWhileElsewhereMostIsHaveChanged) {
  EXPECT_EQ(changes(look(6, 0.85, 0), kVgaRig), (Changes{48, 0}));
  EXPECT_EQ(changes(look(6, 0.85, 7), kVgaRig), (Changes{48, 7}));
}

TEST(Changes, CellsAreNotComparedWhereLittleIsFoundAnywhere) {
  EXPECT_EQ(changes(look(6, 0.3, 7), kVgaRig), Changes()) << "0.7^6 is a tenth";
  const Changes dim = changes(look(20, 0.3, 7), kVgaRig);
  EXPECT_EQ(dim, (Changes{48, 7})) << "0.7^20 is a thousandth";
}

TEST(Changes, TooFewCellsAreNotCompared) {
  EXPECT_EQ(changes({}, kVgaRig), Changes());
  EXPECT_EQ(changes(look(6, 0.9, 2, 7), kVgaRig), Changes());
  EXPECT_EQ(changes(look(6, 0.9, 2, 8), kVgaRig), (Changes{8, 2}));
  EXPECT_EQ(changes(look(6, 0, 0), kVgaRig), Changes()) << "nothing is found at all";
  EXPECT_EQ(changes(look(1, 1, 0), kVgaRig), Changes()) << "one landmark is no part of a picture";
}

TEST(Changes, PointsOutsideThePictureCountInTheCellAtItsEdge) {
  std::vector<SoughtLandmark> sought = look(6, 1, 0);
  for (int n = 0; n < 6; ++n) sought.push_back({{700, -5}, false});
  EXPECT_EQ(changes(sought, kVgaRig), (Changes{48, 0}));
}

TEST(Changes, ARivalIsToldApartByManyMoreChanges) {
  EXPECT_TRUE(told_apart({30, 0}, {30, 4}));
  EXPECT_FALSE(told_apart({30, 0}, {30, 3}));
  EXPECT_FALSE(told_apart({30, 1}, {30, 6}));
  EXPECT_TRUE(told_apart({30, 1}, {30, 7}));
  EXPECT_FALSE(told_apart({}, {30, 9})) << "the place was not compared";
  EXPECT_FALSE(told_apart({30, 9}, {30, 0}));
}

}  // namespace
}  // namespace relmap::place
