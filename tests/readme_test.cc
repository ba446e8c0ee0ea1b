// README.md is true. The commands of its tour are taken from its text and run as printed, in order, each on the results
// of those before; only the folder of the programs is added. The programs that it names are built, and its figures and
// its picture are of one run.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tests/support/process.h"
#include "tests/support/published.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"
#include "tests/support/source_tree.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// From the line that is `heading` to the next heading.
std::vector<std::string> section(const std::string& text, const std::string& heading) {
  std::vector<std::string> found;
  bool inside = false;
  for (const std::string& line : lines_of(text)) {
    if (line.starts_with("## ")) inside = line == heading;
    if (inside) found.push_back(line);
  }
  if (found.empty()) throw std::runtime_error("no section '" + heading + "'");
  return found;
}

// The lines of a section's ```sh blocks that are commands, comments at their ends included.
std::vector<std::string> commands_of(const std::string& text, const std::string& heading) {
  std::vector<std::string> commands;
  bool shell = false;
  for (const std::string& line : section(text, heading)) {
    if (line.starts_with("```"))
      shell = line == "```sh";
    else if (shell && !line.empty() && line[0] != '#')
      commands.push_back(line);
  }
  return commands;
}

std::string readme() { return read_text(RELMAP_SOURCE_DIR "/README.md"); }
constexpr const char* kTour = "## Five minutes' tour";

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

std::string quoted(std::string text) {
  replace_all(text, "'", "'\\''");
  return "'" + text + "'";
}

// These lines cannot be run here as they stand.
bool builds(const std::string& command) { return command.starts_with("tools/setup "); }
bool needs_a_camera(const std::string& command) { return command.find("--source iidc") != std::string::npos; }

// A shell script that runs the commands until one fails, and tells which. Commands that need a camera must fail because
// there is none, which shows that everything else about them is right.
std::string script_of(const std::vector<std::string>& commands) {
  std::string script = "set -o pipefail\ntrap 'kill $(jobs -p) 2>/dev/null; wait' EXIT\n";
  for (std::string command : commands) {
    if (builds(command)) continue;
    replace_all(command, "$PWD/build/release/bin", RELMAP_BIN_DIR);
    script += "printf '%s\\n' " + quoted("$ " + command) + "\n";
    if (needs_a_camera(command))
      script += "{ " + command + "\n} 2>camera.err\n[ $? -eq 1 ] && grep NO_CAMERA camera.err\n";
    else
      script += command + "\n";
    script +=
        "code=$?; [ $code -eq 0 ] || { printf 'exit code %s: %s\\n' $code " + quoted(command) + " >&2; exit 1; }\n";
  }
  return script + "trap - EXIT\nwait\n";  // a second signal would end the daemon at once
}

struct Toured {
  int exit_code;
  std::string told, log;  // the commands and what they print; standard error
};

// In a network of its own, where the addresses that README names are free, with a home of its own.
Toured run_tour(const std::string& home, const std::vector<std::string>& commands) {
  const std::string script = home + "/tour.sh", out = home + "/tour.out", err = home + "/tour.err";
  std::ofstream(script) << script_of(commands);
  // timeout ends what the tour has started as well.
  Process tour({"env", "-u", "XDG_STATE_HOME", "-u", "XDG_CONFIG_HOME", "-u", "RELMAP_SERVER", "HOME=" + home,
                "timeout", "--kill-after=5", "150", "bash", script},
               {.standard_output = out, .standard_error = err, .own_network = Multicast::kOnLoopback});
  const auto code = tour.wait(std::chrono::seconds(165));
  return {code.value_or(-1), read_text(out), read_text(err)};
}

class Tour : public ::testing::Test {
 protected:
  // Recordings "of your own", where README says that they are.
  void record_own() const {
    for (const char* name : {"00", "01"}) {
      fs::create_directories(home_ / "kitti/sequences");
      record_simulation(home_ / "kitti/sequences/" + name,
                        {"--seed", name[1] == '0' ? "3" : "4", "--pairs", "12", "--laps", "0.1"});
    }
  }
  void expect_all_work() const {
    record_own();
    const std::vector<std::string> commands = commands_of(readme(), kTour);
    ASSERT_GT(commands.size(), 15u) << "the tour was not found";
    const Toured toured = run_tour(home_ / "", commands);
    std::cout << toured.told;
    EXPECT_EQ(toured.exit_code, 0) << toured.log;
    // What the reader was told to expect.
    EXPECT_NE(toured.told.find("labels passed  fountain"), std::string::npos);
    EXPECT_TRUE(fs::exists(home_ / "tour/map.svg"));
    EXPECT_NE(toured.log.find("[info] stopped"), std::string::npos) << toured.log;
  }

  const storage::TemporaryFolder home_;
};

TEST_F(Tour, EveryCommandWorksAsPrinted) { expect_all_work(); }

using LongTour = Tour;
TEST_F(LongTour, EveryCommandWorksWhereTheMapHasAnotherRecording) {
  const std::string other = record_simulation(home_ / "other", {"--seed", "2", "--pairs", "130", "--laps", "1.2"});
  fs::create_directories(home_ / "tour");
  RunningDaemon daemon({.data = home_ / "tour/map", .lcm = "", .more = {}});
  const Finished taken = run_program({built_program("relmap"), "--server", home_ / "tour/map", "ingest", other});
  ASSERT_EQ(taken.exit_code, 0) << taken.standard_error;
  ASSERT_EQ(daemon.stop(), 0);
  expect_all_work();
}

TEST_F(Tour, ACommandThatFailsIsNamed) {
  const std::string text = std::string(kTour) + "\n```sh\ntrue\nfalse && true   # so\necho after\n```\n## Next\n";
  const Toured toured = run_tour(home_ / "", commands_of(text, kTour));
  EXPECT_EQ(toured.exit_code, 1);
  EXPECT_NE(toured.log.find("exit code 1: false && true"), std::string::npos) << toured.log;
  EXPECT_EQ(toured.told.find("after"), toured.told.rfind("after")) << toured.told;
  EXPECT_EQ(toured.told.find("after"), std::string::npos) << toured.told;
}

// The first line of the tour is what tools/demo does, which is run often.
TEST(Readme, BuildsAsTheDemoDoes) {
  const std::string demo = read_text(RELMAP_SOURCE_DIR "/tools/demo");
  int seen = 0;
  for (const std::string& line : commands_of(readme(), kTour)) {
    if (!builds(line)) continue;
    const std::string command = line.substr(0, line.find("   #"));
    for (std::size_t from = 0; from < command.size();) {
      const std::size_t to = std::min(command.find(" && ", from), command.size());
      const std::string step = command.substr(from, to - from);
      EXPECT_NE(demo.find("\n  " + step), std::string::npos) << "tools/demo does not run '" << step << "'";
      ++seen;
      from = to + 4;
    }
  }
  EXPECT_EQ(seen, 3);
}

TEST(Readme, OfTheServerDescribesEverySetting) {
  std::string source = content_of("server/ops/config.cc");
  source.erase(0, source.find("settings() {"));
  source.erase(source.find("return table;"));
  const std::string described = content_of("server/README.md");
  const std::regex key(R"re(\{"([a-z_.]+)",)re");
  std::size_t keys = 0;
  for (std::sregex_iterator found(source.begin(), source.end(), key), end; found != end; ++found, ++keys)
    EXPECT_NE(described.find("| `" + found->str(1) + "` |"), std::string::npos) << found->str(1);
  EXPECT_GE(keys, 24u) << "settings() has another form";
}

TEST(Readme, TellsOfTheDriveThatTheDemoMakes) {
  const std::string demo = read_text(RELMAP_SOURCE_DIR "/tools/demo");
  const int pairs = static_cast<int>(published_figure("README.md", "`tools/demo` renders ([0-9]+) stereo pairs"));
  EXPECT_NE(demo.find("\npairs=" + std::to_string(pairs) + "\n"), std::string::npos);
  std::ostringstream laps;
  laps << "--laps " << published_figure("README.md", "a street circuit driven ([0-9.]+) times") << "\n";
  EXPECT_NE(demo.find(laps.str()), std::string::npos) << laps.str();
}

// What README says in short of photographs is what docs/figures.md says, with which the tests on recordings compare.
TEST(Readme, TellsOfPhotographsWhatTheFiguresTell) {
  const std::string figures = "docs/figures.md";
  EXPECT_EQ(published_figure("README.md", "among ([0-9]+) other places"),
            published_figure(figures, "among ([0-9]+) other places"));
  const auto floors = published("README.md", "look alike: ([0-9]+) of ([0-9]+) pictures are confirmed, none of them");
  const auto chosen = published(figures, "thresholds were chosen \\| ([0-9]+) \\| \\| ([0-9]+) \\| 0 \\|");
  const auto judged = published(figures, "thresholds are tested \\| ([0-9]+) \\| \\| ([0-9]+) \\| 0 \\|");
  EXPECT_EQ(floors.at(0), chosen.at(1) + judged.at(1));
  EXPECT_EQ(floors.at(1), chosen.at(0) + judged.at(0));
  EXPECT_EQ(published_figure("README.md", "of all ([0-9]+) pictures one is"),
            published_figure(figures, "Of all ([0-9]+) pictures of the fourteen floors [0-9]+ are confirmed, one of"));
  const auto single = published("README.md",
                                "([0-9]+) of ([0-9]+) are localised in EuRoC's flight, compared with "
                                "([0-9]+) of [0-9]+ if the camera is known");
  EXPECT_EQ(single.at(0), published_figure(figures, "\\| unknown \\| ([0-9]+);"));
  EXPECT_EQ(single.at(1), published_figure(figures, "\\| answered of ([0-9]+) \\|"));
  EXPECT_EQ(single.at(2), published_figure(figures, "\\| the session's camera \\| ([0-9]+);"));
}

// Whoever has run tools/demo has every program that README names.
TEST(Readme, EveryProgramThatItNamesIsBuiltByTheDemo) {
  std::set<std::string> named;
  const auto names_in = [&](const std::string& text, const std::regex& expression) {
    for (std::sregex_iterator it(text.begin(), text.end(), expression), end; it != end; ++it) named.insert((*it)[1]);
  };
  for (const std::string& line : section(readme(), "## Programs")) names_in(line, std::regex("`(relmap[a-z0-9-]*)`"));
  for (const std::string& line : commands_of(readme(), kTour)) names_in(line, std::regex("^(relmap[a-z0-9-]*) "));
  EXPECT_GE(named.size(), 9u);

  const std::string demo = read_text(RELMAP_SOURCE_DIR "/tools/demo");
  const std::size_t from = demo.find("--target");
  ASSERT_NE(from, std::string::npos);
  std::size_t to = demo.find('\n', from);
  while (to != std::string::npos && demo[to - 1] == '\\') to = demo.find('\n', to + 1);
  std::istringstream targets(demo.substr(from, to - from));
  const std::set<std::string> built{std::istream_iterator<std::string>(targets), {}};
  for (const std::string& program : named) {
    EXPECT_TRUE(built.contains(program)) << "tools/demo does not build " << program;
    EXPECT_TRUE(fs::exists(built_program(program))) << program << " is no program";
  }
}

class ReadmeFigures : public ::testing::Test {
 protected:
  ReadmeFigures() {
    for (const char* file : {"README.md", "docs/map.png", "docs/demo.json", "tools/readme"}) {
      fs::create_directories(fs::path(copy_ / file).parent_path());
      fs::copy_file(fs::path(RELMAP_SOURCE_DIR) / file, copy_ / file);
    }
  }
  Finished check() const { return run_program({copy_ / "tools/readme", "--check"}); }
  void change(const std::string& file, std::string_view from, std::string_view to) const {
    std::string text = read_text(copy_ / file);
    ASSERT_NE(text.find(from), std::string::npos);
    replace_all(text, from, to);
    std::ofstream(copy_ / file) << text;
  }

  const storage::TemporaryFolder copy_;
};

TEST_F(ReadmeFigures, TableAndPictureAreOfOneRun) {
  const Finished checked = check();
  EXPECT_EQ(checked.exit_code, 0) << checked.standard_error;
}

TEST_F(ReadmeFigures, AChangedFigureIsSeen) {
  change("README.md", "keyframes mapped; lost, doubled by the kill | ",
         "keyframes mapped; lost, doubled by the kill | 1");
  const Finished checked = check();
  EXPECT_EQ(checked.exit_code, 1);
  EXPECT_NE(checked.standard_error.find("the table in README.md is not of the run"), std::string::npos)
      << checked.standard_error;
}

TEST_F(ReadmeFigures, AnotherRunsFiguresAreSeen) {
  change("docs/demo.json", "\"loop_closures_right\": ", "\"loop_closures_right\": 1");
  EXPECT_EQ(check().exit_code, 1);
}

TEST_F(ReadmeFigures, AnotherPictureIsSeen) {
  std::ofstream(copy_ / "docs/map.png", std::ios::app) << "x";
  const Finished checked = check();
  EXPECT_EQ(checked.exit_code, 1);
  EXPECT_NE(checked.standard_error.find("docs/map.png is not of the run"), std::string::npos) << checked.standard_error;
}

// Commands in the documents, in blocks and within lines: "relmap edge remove 3:120/1 --dry-run".
std::vector<std::string> commands_in(const std::string& text) {
  // Some are run as the user of the daemon.
  static const std::regex within("`(?:runuser -u relmap -- )?(relmap[a-z0-9-]* [^`\\n]*)`");
  static const std::regex alone("^(?:runuser -u relmap -- )?(relmap[a-z0-9-]* .*)$");
  std::vector<std::string> found;
  bool block = false;
  for (const std::string& line : lines_of(text)) {
    if (line.starts_with("```")) block = !block;
    for (std::sregex_iterator it(line.begin(), line.end(), block ? alone : within), end; it != end; ++it)
      found.push_back((*it)[1]);
  }
  return found;
}

class DocumentedCommands : public ::testing::Test {
 protected:
  const std::string& help(const std::vector<std::string>& command) {
    std::string& text = help_[command];
    if (text.empty()) {
      std::vector<std::string> arguments = command;
      arguments.front() = built_program(command.front());
      arguments.emplace_back("--help");
      text = run_program(arguments).standard_output;
    }
    return text;
  }
  static bool lists(const std::string& help, const std::string& name) {
    const std::regex as_a_word("(^|[ ,{])" + name + "($|[^a-z0-9-])");
    return std::regex_search(help, as_a_word);
  }
  static bool has_subcommand(const std::string& help, const std::string& name) {
    const std::size_t from = help.find("\nSubcommands:");
    return from != std::string::npos && help.find("\n  " + name + " ", from) != std::string::npos;
  }
  // What the program does not know of it; empty: nothing.
  std::string unknown_in(const std::string& command) {
    std::istringstream words(command);
    std::vector<std::string> path;
    std::string word, known;
    for (bool naming = true; words >> word;) {
      if (word[0] == '#' || word == "|" || word == "&&" || word == "--") break;  // "--": another program's
      if (path.empty()) {
        if (!fs::exists(built_program(word))) return "the program " + word;
        path.push_back(word);
        known = help(path);
      } else if (word.starts_with("--")) {
        naming = false;  // what follows may be its value
        const std::string option = word.substr(0, word.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"));
        if (!lists(known, option)) return option;
      } else if (has_subcommand(help(path), word)) {
        path.push_back(word);
        known += help(path);
      } else if (naming && std::regex_match(word, std::regex("[a-z-]+")) &&
                 help(path).find("\nSubcommands:") != std::string::npos) {
        return "the command " + word;
      } else {
        naming = false;
      }
    }
    return {};
  }

  static inline std::map<std::vector<std::string>, std::string> help_;  // of all tests
};

TEST_F(DocumentedCommands, AreKnownToThePrograms) {
  std::size_t commands = 0;
  std::vector<fs::path> documents{RELMAP_SOURCE_DIR "/README.md"};
  for (const auto& file : fs::directory_iterator(RELMAP_SOURCE_DIR "/docs"))
    if (file.path().extension() == ".md") documents.push_back(file.path());
  for (const fs::path& document : documents)
    for (const std::string& command : commands_in(read_text(document))) {
      if (command.starts_with("relmap hash ")) continue;  // a line of a file
      EXPECT_EQ(unknown_in(command), "") << document.filename() << ": " << command;
      ++commands;
    }
  EXPECT_GT(commands, 100u);
  EXPECT_EQ(unknown_in("relmap edge remove 3:120/1 --dry-run"), "");
  EXPECT_EQ(unknown_in("relmap edge remove 3:120/1 --dry"), "--dry");
  EXPECT_EQ(unknown_in("relmap-admin verifi /map"), "the command verifi");
  EXPECT_EQ(unknown_in("relmap sesion delete 3"), "the command sesion");
  EXPECT_EQ(unknown_in("relmap session delet 3"), "the command delet");
  EXPECT_EQ(unknown_in("relmap-nothing --help"), "the program relmap-nothing");
}

// Whoever asks for a command's help sees how that command is used.
TEST_F(DocumentedCommands, HaveExamplesInTheirHelp) {
  std::vector<std::vector<std::string>> commands;
  for (const char* program :
       {"relmap", "relmap-admin", "relmap-camera", "relmap-sim", "relmap-vocab", "relmap-bench", "relmap-frontend"})
    commands.push_back({program});
  for (std::size_t at = 0; at < commands.size(); ++at) {
    const std::vector<std::string> command = commands[at];
    const std::string text = help(command);
    std::string example = "\n ";
    for (const std::string& word : command) example += " " + word;
    // Options of the program itself may stand between: "relmap --json ingest".
    const std::regex with_options("\n  " + command.front() + " [^\n]*" + command.back());
    EXPECT_TRUE(text.find(example) != std::string::npos || std::regex_search(text, with_options)) << example;
    const std::size_t from = text.find("\nSubcommands:\n");
    if (from == std::string::npos) continue;
    for (const std::string& line : lines_of(text.substr(from + 14))) {
      if (line.empty()) break;
      std::vector<std::string> deeper = command;
      if (line.starts_with("  ") && line[2] != ' ') deeper.push_back(line.substr(2, line.find(' ', 2) - 2));
      if (deeper.size() > command.size()) commands.push_back(deeper);
    }
  }
  EXPECT_GT(commands.size(), 60u);
}

// A decision that the index does not name is not found.
TEST(Decisions, TheIndexNamesEachByItsHeading) {
  const fs::path folder = fs::path(RELMAP_SOURCE_DIR) / "docs/decisions";
  const std::string index = read_text(folder / "README.md");
  std::size_t decisions = 0;
  for (const auto& file : fs::directory_iterator(folder)) {
    if (file.path().filename() == "README.md") continue;
    EXPECT_NE(index.find("](" + file.path().filename().string() + ")"), std::string::npos) << file.path();
    for (const std::string& line : lines_of(read_text(file.path()))) {
      if (!line.starts_with("## ")) continue;
      ++decisions;
      EXPECT_NE(index.find("- [" + line.substr(3) + "](" + file.path().filename().string() + "#"), std::string::npos)
          << line;
    }
  }
  EXPECT_GT(decisions, 100u);
}

// Pictures and the command that makes each of them.
TEST(Gallery, EachPictureIsSmallAndHasItsCommand) {
  const std::string script = read_text(RELMAP_SOURCE_DIR "/tools/gallery");
  const std::string page = read_text(RELMAP_SOURCE_DIR "/docs/gallery.md");
  std::size_t pictures = 0;
  for (const auto& file : fs::directory_iterator(RELMAP_SOURCE_DIR "/docs/gallery")) {
    const std::string name = file.path().stem();
    EXPECT_EQ(file.path().extension(), ".png");
    EXPECT_LT(fs::file_size(file), 150'000u) << name;
    EXPECT_NE(script.find("    " + name + ")"), std::string::npos) << name;
    EXPECT_NE(page.find("](gallery/" + name + ".png)"), std::string::npos) << name;
    EXPECT_NE(page.find("`tools/gallery " + name + "`"), std::string::npos) << name;
    ++pictures;
  }
  EXPECT_EQ(pictures, 7u);
}

TEST(Readme, EveryPictureThatItShowsIsThere) {
  const std::string text = readme();
  const std::regex shown(R"(!\[[^\]]*\]\(([^)]*)\))");
  std::size_t pictures = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), shown), end; it != end; ++it, ++pictures)
    EXPECT_TRUE(fs::exists(RELMAP_SOURCE_DIR "/" + (*it)[1].str())) << (*it)[1];
  EXPECT_GE(pictures, 5u);
}

}  // namespace
}  // namespace relmap::testing
