#include "frontend/tracking/eyes.h"

#include <gtest/gtest.h>

#include "frontend/tracking/wall_for_test.h"

namespace relmap {
namespace {

using testing_wall::Wall;

Pair exchanged(const Pair& pair) { return {pair.picture, pair.right, pair.left}; }

TEST(Eyes, AreTakenAsTheyAreWhereTheyAreRight) {
  const auto pair = Wall(1).seen(SE3(), 1);
  EXPECT_TRUE(check_eyes(*pair).ok());
}

TEST(Eyes, ThatAreExchangedAreToldByTheSideOnWhichThingsLie) {
  const Status status = check_eyes(exchanged(*Wall(1).seen(SE3(), 1)));
  EXPECT_EQ(status.reason(), Reason::NOT_STEREO);
  EXPECT_NE(status.message().find("exchanged"), std::string::npos) << status.message();
}

TEST(Eyes, OfTheSamePictureAreNone) {
  const auto pair = Wall(1).seen(SE3(), 1);
  const Status status = check_eyes({pair->picture, pair->left, pair->left});
  EXPECT_EQ(status.reason(), Reason::NOT_STEREO);
  EXPECT_NE(status.message().find("same picture"), std::string::npos) << status.message();
}

TEST(Eyes, ThatSeeNothingSayNothing) {
  const auto pair = Wall(1).seen(SE3(), 1);
  EXPECT_TRUE(check_eyes({pair->picture, pair->left, Pyramid()}).ok());
  const auto one = Wall(1).seen(SE3(), 1), another = Wall(2).seen(SE3(), 2);
  EXPECT_TRUE(check_eyes({one->picture, one->left, another->left}).ok());
}

}  // namespace
}  // namespace relmap
