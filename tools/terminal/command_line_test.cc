#include "tools/terminal/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "proto/base/version.h"

namespace relmap::terminal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

TEST(CommandLine, ATypingErrorFindsTheNearestName) {
  const std::vector<std::string> known{"status", "stats", "sessions", "session", "edge", "edges", "map", "match"};
  EXPECT_THAT(likely_meant("statsu", known), ElementsAre("stats", "status"));
  EXPECT_THAT(likely_meant("stat", known), ElementsAre("stats", "status"));
  EXPECT_THAT(likely_meant("sesions", known), ElementsAre("sessions", "session"));
  EXPECT_THAT(likely_meant("mpa", known), ElementsAre("map"));
  EXPECT_THAT(likely_meant("fly", known), IsEmpty());
  EXPECT_THAT(likely_meant("--yess", {"--yes", "--dry-run"}), ElementsAre("--yes"));
  EXPECT_THAT(likely_meant("--dry", {"--yes", "--dry-run"}), ElementsAre("--dry-run"));
}

struct Ended {
  int code = -1;
  std::string out, err;
};

Ended end(std::vector<const char*> arguments) {
  CLI::App app("for a test", "prog");
  add_standard_options(app);
  app.fallthrough();
  app.require_subcommand(1);
  std::string server, id;
  bool yes = false;
  app.add_option("--server", server)->required();
  app.add_subcommand("status", "how it is");
  CLI::App* edge = app.add_subcommand("edge", "of a graph");
  edge->require_subcommand(1);
  CLI::App* remove = edge->add_subcommand("remove", "takes it out");
  remove->add_option("ID", id)->required();
  remove->add_flag("--yes", yes);
  remove->footer("Examples:\n  prog edge remove 1");
  arguments.insert(arguments.begin(), "prog");
  std::ostringstream out, err;
  Ended ended;
  try {
    app.parse(static_cast<int>(arguments.size()), arguments.data());
    ended.code = 100;  // it would run
  } catch (const CLI::ParseError& error) {
    ended.code = end_with(app, error, out, err, 2);
  }
  ended.out = out.str();
  ended.err = err.str();
  return ended;
}

TEST(CommandLine, AMistypedCommandOrOptionGetsASuggestion) {
  const std::pair<std::vector<const char*>, const char*> slips[] = {
      {{"statsu"}, "prog has no command 'statsu'. Did you mean status?\nRun prog --help"},
      {{"--server", "a", "fly"}, "prog has no command 'fly'. It has status and edge.\n"},
      {{"--server", "a", "edge", "remov", "1"},
       "prog edge has no command 'remov'. Did you mean remove?\nRun prog edge "},
      {{"--server", "a", "edge", "remove", "1", "--yess"},
       "prog edge remove has no option '--yess'. Did you mean --yes?\nRun prog edge remove --help"},
      {{"--servr=a", "status"}, "prog status has no option '--servr'. Did you mean --server?\n"},
      {{"--server", "a", "status", "--quite-another"}, "prog status has no option '--quite-another'.\nRun"},
      {{"--server", "a", "edge", "remove", "1", "2"}, "The following argument was not expected: 2\n"},
      {{"status"}, "--server is required\nRun prog status --help"},
  };
  for (const auto& [arguments, said] : slips) {
    const Ended ended = end(arguments);
    EXPECT_EQ(ended.code, 2) << said;
    EXPECT_THAT(ended.err, StartsWith(said));
    EXPECT_EQ(ended.out, "");
  }
}

TEST(CommandLine, HelpIsOfTheGivenCommandAndTheVersionIsPrinted) {
  const Ended help = end({"edge", "remove", "--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.out, HasSubstr("prog edge remove 1"));
  EXPECT_EQ(help.err, "");
  const Ended version = end({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.out, version_line() + "\n");
}

TEST(CommandLine, ManualAndCompletionAreWrittenWhateverElseIsRequired) {
  const Ended manual = end({"--manual"});
  EXPECT_EQ(manual.code, 0);
  EXPECT_THAT(manual.out, StartsWith(".TH PROG 1 "));
  EXPECT_THAT(manual.out, HasSubstr("\n.SS edge remove\n"));
  const Ended below = end({"edge", "remove", "--completion", "fish"});
  EXPECT_EQ(below.code, 0);
  EXPECT_THAT(below.out, StartsWith("# fish completion of prog"));
  const Ended unknown = end({"--completion", "csh"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("csh not in {bash,zsh,fish}"));
  const Ended help = end({"--help"});
  EXPECT_EQ(help.out.find("--manual"), std::string::npos);
}

}  // namespace
}  // namespace relmap::terminal
