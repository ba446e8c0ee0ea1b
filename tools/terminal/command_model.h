// A command line as plain values, taken from its definition (CLI11). Manual pages and completions are written from it.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace relmap::terminal {

struct OptionModel {
  std::vector<std::string> names;  // "-q", "--quiet"; of a positional its only name, as "FILE"
  std::string help;                // in one line
  std::string value;               // "FILE", "NUMBER"; empty: a flag, which takes none
  std::vector<std::string> words;  // the value is one of these, unless empty
  std::string bounds;              // "0.001 to 86400", "at least 1"; empty: none
  std::string fallback;            // the value if it is not given; empty: none, or told by `help`
  std::string variable;            // of the environment, that gives the value if the option does not; empty: none
  std::vector<std::string> needs, excludes;  // other options, by name
  bool required = false;
  bool repeated = false;

  bool flag() const { return value.empty(); }
  // By the name of the value, which may have alternatives: "FRAME|FILE".
  bool takes_file() const;
  bool takes_folder() const;
};

struct CommandModel {
  std::vector<std::string> path;  // {"relmap", "session", "freeze"}
  std::string description, footer;
  std::vector<OptionModel> positionals, options;
  std::vector<CommandModel> commands;
  bool inherited = false;  // its options may follow the names of its commands, too

  const std::string& name() const { return path.back(); }
  std::string full_name() const;  // "relmap session freeze"
};

// Hidden options and commands are left out.
CommandModel model_of(const CLI::App& app);

}  // namespace relmap::terminal
