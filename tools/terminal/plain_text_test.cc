#include "tools/terminal/plain_text.h"

#include <gtest/gtest.h>

namespace relmap::terminal {
namespace {

TEST(PlainText, WrapsParagraphsAndItemsAndLeavesMarksOut) {
  EXPECT_EQ(plain_text("### DISK_FULL\n\nThe **disk** of the [data folder](operations.md#the-disk) is\nfull.\n", 20),
            "DISK_FULL\n\nThe disk of the data\nfolder is full.\n");
  EXPECT_EQ(plain_text("- make room elsewhere, and wait\n- never delete\n1. one two three four five\n", 21),
            "- make room\n  elsewhere, and wait\n- never delete\n1. one two three four\n   five\n");
}

TEST(PlainText, BreaksNoCommand) {
  EXPECT_EQ(plain_text("Run `relmap --server /var/lib/relmap status --all` now.", 20),
            "Run\nrelmap --server /var/lib/relmap status --all\nnow.\n");
  EXPECT_EQ(plain_text("Run:\n\n```sh\nrelmap status   # a *b* `c`\n\ndf -h\n```\n\nThen wait.", 10),
            "Run:\n\n    relmap status   # a *b* `c`\n\n    df -h\n\nThen wait.\n");
}

TEST(PlainText, OfNothingIsEmpty) {
  EXPECT_EQ(plain_text("", 80), "");
  EXPECT_EQ(plain_text("\n\n", 80), "");
}

}  // namespace
}  // namespace relmap::terminal
