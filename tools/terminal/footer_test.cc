#include "tools/terminal/footer.h"

#include <gtest/gtest.h>

namespace relmap::terminal {
namespace {

TEST(Footer, IsDividedIntoParagraphsExamplesAndItems) {
  const auto parts = parts_of(
      "\nOne paragraph\nin two lines.\n\nAnother: with a colon.\nExamples:\n  prog a   # why\n  prog b \\\n      --c\n"
      "Exit codes:\n  0    done\n  130  interrupted\n       by a signal\n\nThe end.");
  ASSERT_EQ(parts.size(), 5u);
  EXPECT_EQ(parts[0].paragraph, "One paragraph in two lines.");
  EXPECT_EQ(parts[1].paragraph, "Another: with a colon.");
  EXPECT_EQ(parts[2].heading, "Examples");
  EXPECT_EQ(parts[2].commands, (std::vector<std::string>{"prog a   # why", "prog b \\", "    --c"}));
  EXPECT_EQ(parts[3].heading, "Exit codes");
  ASSERT_EQ(parts[3].items.size(), 2u);
  EXPECT_EQ(parts[3].items[0].term, "0");
  EXPECT_EQ(parts[3].items[1].term, "130");
  EXPECT_EQ(parts[3].items[1].text, "interrupted by a signal");
  EXPECT_EQ(parts[4].paragraph, "The end.");
}

TEST(Footer, TakesOneExampleForExamples) {
  const auto parts = parts_of("Example:\n  prog a");
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].heading, "Examples");
  EXPECT_TRUE(parts_of("").empty());
}

TEST(Footer, KeepsATermWithoutAText) {
  const auto parts = parts_of("Files:\n  left and right\n  calib.txt  P0 and P1");
  ASSERT_EQ(parts.size(), 1u);
  ASSERT_EQ(parts[0].items.size(), 2u);
  EXPECT_EQ(parts[0].items[0].term, "left and right");
  EXPECT_EQ(parts[0].items[0].text, "");
  EXPECT_EQ(parts[0].items[1].text, "P0 and P1");
}

}  // namespace
}  // namespace relmap::terminal
