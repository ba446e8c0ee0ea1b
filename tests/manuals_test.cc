// The manual pages and completions that the build makes: pages that tell of everything and that readers of manuals
// take, and completions that bash, zsh and fish really give.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "proto/base/version.h"
#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

const std::string kShare = RELMAP_BIN_DIR "/../share/";
constexpr std::size_t kColumns = 80;

const std::map<std::string, std::string> kPages = {{"relmap", "man1/relmap.1"},
                                                   {"relmap-admin", "man8/relmap-admin.8"},
                                                   {"relmap-camera", "man1/relmap-camera.1"},
                                                   {"relmap-console", "man1/relmap-console.1"},
                                                   {"relmap-frontend", "man1/relmap-frontend.1"},
                                                   {"relmap-sim", "man1/relmap-sim.1"},
                                                   {"relmap-vocab", "man1/relmap-vocab.1"},
                                                   {"relmapd", "man8/relmapd.8"}};

std::string page_of(const std::string& program) { return kShare + "man/" + kPages.at(program); }

std::vector<std::string> lines_in(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Without requests for fonts and with signs for what they stand for.
std::string plain(std::string roff) {
  for (const auto& [from, to] : {std::pair("\\\\f[BIR]", ""), std::pair("\\\\-", "-"), std::pair("\\\\\\(aq", "'")})
    roff = std::regex_replace(roff, std::regex(from), to);
  return roff;
}

void expect_clean(const std::string& page) {
  for (const std::vector<std::string>& reader : std::vector<std::vector<std::string>>{
           {"groff", "-man", "-Tutf8", "-ww", "-z", page}, {"mandoc", "-T", "lint", "-W", "warning", page}}) {
    const Finished read = run_program(reader);
    EXPECT_EQ(read.exit_code, 0) << page;
    EXPECT_EQ(read.standard_output + read.standard_error, "") << reader.front();
  }
}

TEST(Manuals, AreCleanForGroffAndMandoc) {
  for (const auto& [program, file] : kPages) {
    const std::string page = page_of(program);
    expect_clean(page);
    EXPECT_THAT(read_text(page), HasSubstr("\"relmap " + std::string(version()) + "\"")) << page;
  }
}

// Programs whose pages are not installed can write them as well.
TEST(Manuals, OfEveryProgramAreWrittenOnDemand) {
  const storage::TemporaryFolder folder;
  for (const char* program : {"relmap-bench", "relmap-simulated-camera"}) {
    const Finished written = run_program({built_program(program), "--manual"});
    ASSERT_EQ(written.exit_code, 0) << program;
    std::ofstream(folder / program) << written.standard_output;
    expect_clean(folder / program);
  }
  // Even where something else is required, and below a command.
  EXPECT_EQ(run_program({built_program("relmap"), "route", "--manual"}).exit_code, 0);
  EXPECT_EQ(run_program({built_program("relmap"), "--completion", "bash"}).exit_code, 0);
  const Finished refused = run_program({built_program("relmap"), "--completion", "csh"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.standard_error, HasSubstr("csh not in {bash,zsh,fish}"));
  EXPECT_THAT(run_program({built_program("relmap"), "--help"}).standard_output, Not(HasSubstr("--completion")));
}

TEST(Manuals, FitATerminalOf80Columns) {
  for (const auto& [program, file] : kPages) {
    const Finished shown =
        run_program({"groff", "-man", "-Tascii", "-P-c", "-P-b", "-P-u", "-rLL=78n", page_of(program)});
    ASSERT_EQ(shown.exit_code, 0) << program;
    EXPECT_GT(lines_in(shown.standard_output).size(), 50u) << program;
    for (const std::string& line : lines_in(shown.standard_output)) EXPECT_LE(line.size(), kColumns) << line;
  }
}

// The part of a page that tells of one command; of the program, the whole page.
std::string part_of_page(const std::string& page, const std::vector<std::string>& command) {
  if (command.size() == 1) return page;
  std::string heading = "\n.SS";
  for (std::size_t i = 1; i < command.size(); ++i) heading += " " + command[i];
  const std::size_t from = page.find(heading + "\n");
  if (from == std::string::npos) return "";
  return page.substr(from, page.find("\n.S", from + 1) - from);
}

// Follows --help, which CLI11 writes, down to every command.
TEST(Manuals, TellOfEveryCommandAndOption) {
  std::size_t commands = 0, options = 0;
  for (const auto& [program, file] : kPages) {
    const std::string page = plain(read_text(page_of(program)));
    std::vector<std::vector<std::string>> known{{program}};
    for (std::size_t at = 0; at < known.size(); ++at, ++commands) {
      const std::vector<std::string> command = known[at];
      std::string name = command.front();
      for (std::size_t i = 1; i < command.size(); ++i) name += " " + command[i];
      const std::string part = part_of_page(page, command);
      EXPECT_THAT(part, HasSubstr("\n" + name + " ")) << "usage of " << name;
      std::vector<std::string> arguments = command;
      arguments.front() = built_program(program);
      arguments.emplace_back("--help");
      std::string heading;
      for (const std::string& line : lines_in(run_program(arguments).standard_output)) {
        if (line.empty() || line.front() != ' ') heading = line;
        if (!line.starts_with("  ") || line[2] == ' ') continue;
        const std::string word = line.substr(2, line.find_first_of(" {", 2) - 2);
        if (heading == "Subcommands:") {
          known.push_back(command);
          known.back().push_back(word);
        } else if (heading == "Options:" || heading == "Positionals:") {
          if (command.size() > 1 && word == "-h,--help") continue;  // told once
          const std::string option = std::regex_replace(word, std::regex(","), ", ");
          EXPECT_TRUE(std::regex_search(part, std::regex("\n\\.TP\n" + option + "( |\\.\\.\\.|\n)")))
              << name << ' ' << option;
          ++options;
        }
      }
    }
  }
  EXPECT_GT(commands, 50u);
  EXPECT_GT(options, 200u);
}

TEST(Manuals, HaveExitCodesExamplesAndOneAnother) {
  for (const auto& [program, file] : kPages) {
    const std::string page = plain(read_text(page_of(program)));
    for (const char* heading : {"NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXIT STATUS", "EXAMPLES", "SEE ALSO"})
      EXPECT_THAT(page, HasSubstr(std::string("\n.SH ") + heading + "\n")) << program;
    const std::string others = page.substr(page.rfind("\n.SH SEE ALSO"));
    for (const auto& [other, section] : kPages)
      EXPECT_EQ(others.find(other + "(" + section.substr(3, 1) + ")") != std::string::npos, other != program)
          << other << " in the page of " << program;
  }
}

std::string bash_file(const std::string& program) { return kShare + "bash-completion/completions/" + program; }
std::string fish_file(const std::string& program) { return kShare + "fish/vendor_completions.d/" + program + ".fish"; }
std::string zsh_folder() { return kShare + "zsh/vendor-completions"; }

// What bash offers for the last of the words.
std::vector<std::string> offered_by_bash(const std::vector<std::string>& words) {
  std::vector<std::string> arguments{"bash",
                                     "--norc",
                                     "-c",
                                     "source \"$1\"; shift; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); \"_$1\"; "
                                     "printf '%s\\n' \"${COMPREPLY[@]}\"",
                                     "bash",
                                     bash_file(words.front())};
  arguments.insert(arguments.end(), words.begin(), words.end());
  const Finished done = run_program(arguments);
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.standard_error, "");
  std::vector<std::string> offered = lines_in(done.standard_output);
  std::erase(offered, "");
  return offered;
}

// What fish offers behind a line, without the descriptions.
std::vector<std::string> offered_by_fish(const std::string& line) {
  const std::string program = line.substr(0, line.find(' '));
  const Finished done =
      run_program({"fish", "--no-config", "-c", "source '" + fish_file(program) + "'; complete -C '" + line + "'"});
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.standard_error, "");
  std::vector<std::string> offered;
  for (const std::string& each : lines_in(done.standard_output)) offered.push_back(each.substr(0, each.find('\t')));
  return offered;
}

// An interactive zsh at a terminal of its own, whose compadd tells what it adds.
constexpr const char* kZsh = R"(
zmodload zsh/zpty
zpty z zsh -f -i
zpty -w z "PROMPT=; fpath=($1 \$fpath); autoload -Uz compinit; compinit -u -D; zle -C offer list-choices offered
bindkey '^I' offer
compadd() { local -a __all; builtin compadd -A __all \"\$@\"; print -l -- OFFERED:\${^__all}; builtin compadd \"\$@\" }
offered() { _main_complete; print -- ALL'DONE' }
print -- ALL'READY'"
zpty -r z reply '*ALLREADY*'
zpty -w -n z "$2"$'\t'
zpty -r z reply '*ALLDONE*'
print -r -- "$reply"
)";
std::set<std::string> offered_by_zsh(const std::string& line) {
  const Finished done = run_program({"zsh", "-f", "-c", kZsh, "zsh", zsh_folder(), line});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  std::set<std::string> offered;
  const std::regex found("OFFERED:([^\r\n]+)");
  for (std::sregex_iterator it(done.standard_output.begin(), done.standard_output.end(), found), end; it != end; ++it)
    offered.insert((*it)[1]);
  return offered;
}

TEST(Completions, AreScriptsThatTheShellsTake) {
  for (const auto& [program, file] : kPages)
    for (const std::vector<std::string>& check :
         std::vector<std::vector<std::string>>{{"bash", "-n", bash_file(program)},
                                               {"zsh", "-n", zsh_folder() + "/_" + program},
                                               {"fish", "--no-execute", fish_file(program)}}) {
      const Finished checked = run_program(check);
      EXPECT_EQ(checked.exit_code, 0) << check.back();
      EXPECT_EQ(checked.standard_output + checked.standard_error, "") << check.back();
    }
}

TEST(Completions, OfBashOfferCommandsOptionsAndWords) {
  EXPECT_THAT(offered_by_bash({"relmap", "ro"}), ElementsAre("route"));
  EXPECT_THAT(offered_by_bash({"relmap", "route", "--b"}), ElementsAre("--by"));
  EXPECT_THAT(offered_by_bash({"relmap", "route", "--by", ""}), ElementsAre("distance", "time", "certainty"));
  EXPECT_THAT(offered_by_bash({"relmap", "route", "--by", "=", "t"}), ElementsAre("time"));
  EXPECT_THAT(offered_by_bash({"relmap", "route", "--by", "="}), ElementsAre("distance", "time", "certainty"));
  EXPECT_THAT(offered_by_bash({"relmap", "session", "fr"}), ElementsAre("freeze"));
  EXPECT_THAT(offered_by_bash({"relmap", "--server", "session", "--json", "session", ""}),
              ElementsAre("freeze", "thaw", "delete"));
  // An option of the program may follow the command.
  EXPECT_THAT(offered_by_bash({"relmap", "session", "freeze", "--ser"}), ElementsAre("--server"));
  EXPECT_THAT(offered_by_bash({"relmap-sim", "pictures", "--vers"}), IsEmpty());
  EXPECT_THAT(offered_by_bash({"relmapd", "--log-level", ""}),
              ElementsAre("trace", "debug", "info", "warning", "error"));
}

TEST(Completions, OfBashOfferFilesWhereTheyBelong) {
  const storage::TemporaryFolder folder;
  fs::create_directory(folder / "a folder");
  std::ofstream(folder / "a file") << "";
  const std::string typed = folder / "a";
  EXPECT_THAT(offered_by_bash({"relmapd", "--data", typed}), ElementsAre(folder / "a folder"));
  EXPECT_THAT(offered_by_bash({"relmapd", "--config", typed}),
              UnorderedElementsAre(folder / "a folder", folder / "a file"));
  EXPECT_THAT(offered_by_bash({"relmap", "import", "g2o", typed}), Contains(folder / "a file"));
  EXPECT_THAT(offered_by_bash({"relmap", "ingest", "first", "second", typed}), Contains(folder / "a file"));
  EXPECT_THAT(offered_by_bash({"relmap", "frame", typed}), IsEmpty());
  EXPECT_THAT(offered_by_bash({"relmap", "route", "--max-cost", typed}), IsEmpty());
}

// Behind "--" there are neither options nor commands.
TEST(Completions, OfBashOfferOnlyArgumentsBehindTwoDashes) {
  const storage::TemporaryFolder folder;
  std::ofstream(folder / "--by") << "";
  EXPECT_THAT(offered_by_bash({"relmap", "--", ""}), IsEmpty());
  EXPECT_THAT(offered_by_bash({"relmap", "session", "--", ""}), IsEmpty());
  EXPECT_THAT(offered_by_bash({"relmap", "route", "--", "--b"}), IsEmpty());
  EXPECT_THAT(offered_by_bash({"relmap", "import", "g2o", "--", folder / "--b"}), ElementsAre(folder / "--by"));
}

TEST(Completions, OfFishOfferCommandsOptionsWordsAndFiles) {
  const storage::TemporaryFolder folder;
  fs::create_directory(folder / "folder");
  std::ofstream(folder / "file") << "";
  EXPECT_THAT(offered_by_fish("relmap ro"), ElementsAre("route"));
  EXPECT_THAT(offered_by_fish("relmap route --b"), ElementsAre("--by"));
  EXPECT_THAT(offered_by_fish("relmap route --by "), UnorderedElementsAre("distance", "time", "certainty"));
  EXPECT_THAT(offered_by_fish("relmap session fr"), ElementsAre("freeze"));
  EXPECT_THAT(offered_by_fish("relmap session freeze --ser"), ElementsAre("--server"));
  EXPECT_THAT(offered_by_fish("relmap --server session --json session "),
              UnorderedElementsAre("freeze", "thaw", "delete"));
  EXPECT_THAT(offered_by_fish("relmap -- "), IsEmpty());
  EXPECT_THAT(offered_by_fish("relmap frame "), IsEmpty());
  EXPECT_THAT(offered_by_fish("relmapd --data " + (folder / "f")), ElementsAre(folder / "folder/"));
  EXPECT_THAT(offered_by_fish("relmap import g2o " + (folder / "f")), Contains(folder / "file"));
  EXPECT_THAT(offered_by_fish("relmap import g2o -- " + (folder / "f")), Contains(folder / "file"));
}

TEST(Completions, OfZshOfferCommandsOptionsWordsAndFiles) {
  EXPECT_THAT(offered_by_zsh("relmap ro"), ElementsAre("route"));
  EXPECT_THAT(offered_by_zsh("relmap route --b"), ElementsAre("--by"));
  EXPECT_THAT(offered_by_zsh("relmap route --by "), UnorderedElementsAre("distance", "time", "certainty"));
  EXPECT_THAT(offered_by_zsh("relmap --json session "), UnorderedElementsAre("freeze", "thaw", "delete"));
  EXPECT_THAT(offered_by_zsh("relmap edge remove --on"), ElementsAre("--only-this"));
  EXPECT_THAT(offered_by_zsh("relmap edge remove --yes --on"), IsEmpty()) << "the two exclude each other";
  EXPECT_THAT(offered_by_zsh("relmap -- "), IsEmpty());
  EXPECT_THAT(offered_by_zsh("relmap route -- --b"), IsEmpty());
  // zsh tells of the folders on the way, too.
  EXPECT_THAT(offered_by_zsh("relmapd --data " RELMAP_SOURCE_DIR "/te"), Contains("tests"));
  EXPECT_THAT(offered_by_zsh("relmapd --config " RELMAP_SOURCE_DIR "/LIC"), Contains("LICENSE"));
  EXPECT_THAT(offered_by_zsh("relmapd --data " RELMAP_SOURCE_DIR "/LIC"), Not(Contains("LICENSE")));
}

}  // namespace
}  // namespace relmap::testing
