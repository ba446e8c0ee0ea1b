#include "proto/base/markup.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(MarkupText, EndsNeitherElementsNorAttributes) {
  EXPECT_EQ(markup_text("a</td><script>alert('x')</script>"),
            "a&lt;/td&gt;&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;");
  EXPECT_EQ(markup_text("\" onload=\"x & y"), "&quot; onload=&quot;x &amp; y");
}

TEST(MarkupText, KeepsEveryLetter) { EXPECT_EQ(markup_text("Küche 厨房 שלום"), "Küche 厨房 שלום"); }

TEST(MarkupText, TurnsNothingAround) {
  EXPECT_EQ(markup_text("a\u202Egnp.exe\u2066b\u200F"), "a\uFFFDgnp.exe\uFFFDb\uFFFD");
}

TEST(MarkupText, ReplacesWhatXmlForbids) {
  EXPECT_EQ(markup_text(std::string_view("a\0b\x1b[31m\x7f", 9)), "a\uFFFDb\uFFFD[31m\uFFFD");
  EXPECT_EQ(markup_text("caf\xe9!"), "caf\uFFFD!");
  EXPECT_EQ(markup_text("\xed\xa0\x80"), "\uFFFD\uFFFD\uFFFD") << "a surrogate is no letter";
  EXPECT_EQ(markup_text("one\ttwo\nthree\r"), "one two three\uFFFD");
}

}  // namespace
}  // namespace relmap
