#include "tools/terminal/console.h"

#include <gtest/gtest.h>

#include <sstream>

#include "tools/terminal/progress_bar.h"

namespace relmap::terminal {
namespace {

TEST(Console, AlignsTextLeftAndNumbersRight) {
  std::ostringstream out, err;
  Console(out, err).table({"name", ">n"}, {{"Zürich", "7"}, {"a", "120"}});
  EXPECT_EQ(out.str(), "name      n\nZürich    7\na       120\n");
}

TEST(Console, PrintsRepliesOnlyAsJsonAndOnlyThoseThatAreTheAnswer) {
  std::ostringstream out, err;
  Console console(out, err);
  console.reply("{1}");
  console.json = true;
  {
    const Console::Aside aside(console);
    console.reply("{2}");
  }
  console.reply("{3}");
  EXPECT_EQ(out.str(), "{3}\n");
}

TEST(Console, ShowsForeignTextsWithoutObeyingThem) {
  std::ostringstream out, err;
  Console console(out, err);
  console.table({"label", ">n"}, {{"a\x1b[2J", "1"}, {"b\u202E", "2"}});
  console.facts({{"robot \a", "x\ny"}});
  console.report({Reason::BAD_NAME, "of 'a\x1b[1m'\nsecond line"});
  console.report({});
  EXPECT_EQ(out.str(), "label  n\na\uFFFD[2J  1\nb\uFFFD     2\nrobot \uFFFD  x y\n");
  EXPECT_EQ(err.str(), "BAD_NAME: of 'a\uFFFD[1m'\nsecond line\n");
}

TEST(Units, AreHumanReadable) {
  EXPECT_EQ(bytes_text(1234), "1.2 kB");
  EXPECT_EQ(bytes_text(1500000000), "1.5 GB");
  EXPECT_EQ(bar_text(0, 100), "[....................]");
  EXPECT_EQ(bar_text(1, 100), "[#...................]");
  EXPECT_EQ(bar_text(50, 100), "[##########..........]");
  EXPECT_EQ(bar_text(500, 100), "[####################]");
  EXPECT_EQ(duration_text(4.52), "4.5 s");
  EXPECT_EQ(duration_text(185), "3 min 05 s");
  EXPECT_EQ(duration_text(3 * 3600 + 12 * 60), "3 h 12 min");
  EXPECT_EQ(duration_text(12 * 86400 + 5 * 3600 + 59), "12 d 5 h");
  EXPECT_EQ(vector_text({0.0001, -0.0001, -1}), "(0.000, 0.000, -1.000)");
  EXPECT_EQ(time_text(1'700'000'000'123'456), "2023-11-14T22:13:20.123Z");
}

TEST(ProgressBar, PrintsALineForEachStepWithoutATerminal) {
  std::ostringstream err;
  ProgressBar bar(err, false);
  for (std::uint64_t done = 0; done <= 200; ++done) bar.show("copying", done, 200, "frames");
  bar.show("checking", 0, 0, "");
  bar.show("", 0, 0, "");  // nothing is said of no step
  bar.end();
  const std::string text = err.str();
  EXPECT_EQ(text, "copying: 0 of 200 frames\ncopying: 200 of 200 frames\nchecking\n");
}

TEST(ProgressBar, RedrawsItselfOnATerminalAndLeavesNothingBehind) {
  std::ostringstream err;
  ProgressBar bar(err, true);
  bar.show("copying", 1000000, 4000000, "bytes");
  EXPECT_NE(err.str().find("1.0 MB of 4.0 MB"), std::string::npos) << err.str();
  bar.show("copying", 4000000, 4000000, "bytes");
  EXPECT_NE(err.str().find("4.0 MB of 4.0 MB"), std::string::npos) << "its end is shown, however soon it follows";
  bar.end();
  EXPECT_TRUE(err.str().ends_with("\r\x1b[K")) << err.str();
  EXPECT_EQ(err.str().find('\n'), std::string::npos);
}

}  // namespace
}  // namespace relmap::terminal
