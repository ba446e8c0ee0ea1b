#include "server/ingest/replay_window.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace relmap::ingest {
namespace {

TEST(ReplayWindow, LetsEachCountPassOnce) {
  ReplayWindow window;
  EXPECT_FALSE(window.pass(0));
  for (const std::uint64_t count : {1, 2, 3, 7, 5, 6}) {
    EXPECT_TRUE(window.pass(count)) << count;
    EXPECT_FALSE(window.pass(count)) << count;
  }
  EXPECT_TRUE(window.pass(4));
}

TEST(ReplayWindow, RefusesWhatIsFarBehind) {
  ReplayWindow window;
  EXPECT_TRUE(window.pass(5000));
  EXPECT_FALSE(window.pass(5000 - ReplayWindow::kSize));
  EXPECT_TRUE(window.pass(5001 - ReplayWindow::kSize));
  EXPECT_TRUE(window.pass(UINT64_MAX));
  EXPECT_FALSE(window.pass(UINT64_MAX));
  EXPECT_FALSE(window.pass(5000));
  EXPECT_TRUE(window.pass(UINT64_MAX - 1));
}

// Against a set of all counts that passed.
TEST(ReplayWindow, DoesAsItsDefinitionSays) {
  std::mt19937_64 random(1);
  for (const int spread : {10, 900, 3000}) {
    ReplayWindow window;
    std::set<std::uint64_t> passed;
    std::uint64_t highest = 0;
    for (int i = 0; i < 20000; ++i) {
      const std::int64_t ahead = static_cast<std::int64_t>(random() % (2 * spread)) - spread;
      const std::uint64_t count = static_cast<std::uint64_t>(
          std::max<std::int64_t>(0, static_cast<std::int64_t>(highest) + ahead / (i % 3 + 1)));
      const bool expected = count != 0 && count + ReplayWindow::kSize > highest && !passed.contains(count);
      ASSERT_EQ(window.pass(count), expected) << count << " after " << highest;
      if (expected) passed.insert(count);
      highest = std::max(highest, expected ? count : highest);
    }
  }
}

}  // namespace
}  // namespace relmap::ingest
