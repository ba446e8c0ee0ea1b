#include "proto/base/visible_text.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(VisibleText, DoesNothingToATerminal) {
  EXPECT_EQ(visible_text("a\x1b[2Jb\a\b\x7f"), "a\uFFFD[2Jb\uFFFD\uFFFD\uFFFD");
  EXPECT_EQ(visible_text("a\u009b31mb"), "a\uFFFD31mb") << "the sequence introducer of eight bits";
  EXPECT_EQ(visible_text("one\ttwo\nthree\r"), "one two three\uFFFD");
}

TEST(VisibleText, TurnsNothingAround) {
  EXPECT_EQ(visible_text("a\u202Egnp.exe\u2066b\u200F\u061C"), "a\uFFFDgnp.exe\uFFFDb\uFFFD\uFFFD");
}

TEST(VisibleText, KeepsWhatCanBeSeen) { EXPECT_EQ(visible_text("Küche <b>&'\" 厨房 שלום"), "Küche <b>&'\" 厨房 שלום"); }

TEST(VisibleText, ReplacesWhatIsNoLetter) { EXPECT_EQ(visible_text("caf\xe9!"), "caf\uFFFD!"); }

}  // namespace
}  // namespace relmap
