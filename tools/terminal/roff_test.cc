#include "tools/terminal/roff.h"

#include <gtest/gtest.h>

namespace relmap::terminal {
namespace {

TEST(Roff, TextStandsAsItWasWritten) {
  EXPECT_EQ(roff_escaped("a\\b it's `x` ~/\"y\""), "a\\eb it\\(aqs \\(gax\\(ga \\(ti/\\(dqy\\(dq");
  EXPECT_EQ(roff_prose(".TH is no request"), "\\&.TH is no request");
  EXPECT_EQ(roff_prose("'tis"), "\\(aqtis");
}

TEST(Roff, OptionsAndQuotedCommandsAreBold) {
  EXPECT_EQ(roff_prose("needs --dry-run, or (--yes)"), "needs \\fB\\-\\-dry\\-run\\fR, or (\\fB\\-\\-yes\\fR)");
  EXPECT_EQ(roff_prose("see `prog list`."), "see \\fBprog list\\fR.");
  EXPECT_EQ(roff_prose("a -- b"), "a \\-\\- b");
}

TEST(Roff, CommandsThatAreTooWideAreContinued) {
  const std::string wide(56, 'x');
  EXPECT_EQ(roff_commands({"prog " + wide + " --out file"}),
            ".RS 4\n.nf\nprog " + wide + " \\e\n    \\-\\-out file\n.fi\n.RE\n");
  EXPECT_EQ(roff_commands({"prog " + wide + " | jq --raw .x"}),
            ".RS 4\n.nf\nprog " + wide + " |\n    jq \\-\\-raw .x\n.fi\n.RE\n");
  EXPECT_EQ(roff_commands({"prog " + wide + "   # a comment"}),
            ".RS 4\n.nf\n# a comment\nprog " + wide + "\n.fi\n.RE\n");
  EXPECT_EQ(roff_commands({"prog --north " + std::string(45, 'x') + " --east -1.25"}),
            ".RS 4\n.nf\nprog \\-\\-north " + std::string(45, 'x') + " \\e\n    \\-\\-east \\-1.25\n.fi\n.RE\n");
  // Not within quotes, even if it stays too wide.
  EXPECT_EQ(roff_commands({"'" + wide + " " + wide + "'"}),
            ".RS 4\n.nf\n\\(aq" + wide + " " + wide + "\\(aq\n.fi\n.RE\n");
}

}  // namespace
}  // namespace relmap::terminal
