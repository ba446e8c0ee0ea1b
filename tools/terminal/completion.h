// Completions of command lines in shells, written from the definitions of command lines.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace relmap::terminal {

struct CommandModel;
struct OptionModel;

enum class Shell { kBash, kZsh, kFish };

// "bash", "zsh", "fish"
const std::vector<std::string>& shell_names();
std::optional<Shell> shell_of(const std::string& name);

// A script that teaches the shell to complete the program's commands, options, the words that options take, and files
// and folders. It is for the folder from which the shell loads completions by the name of the program.
std::string completion(const CLI::App& app, Shell shell);

std::string bash_completion(const CommandModel& program);
std::string zsh_completion(const CommandModel& program);
std::string fish_completion(const CommandModel& program);

// What the scripts have in common.

// "/session/freeze": where a command is, within its program; of the program itself "".
std::string place_of(const CommandModel& command);
// As one word of a shell, in single quotes; of POSIX shells, zsh among them.
std::string shell_quoted(const std::string& text);
// A command, and the options that may be given behind its name: its own, and those of the commands above it that it
// inherits. Options of the same name: the nearest.
struct CompletedCommand {
  const CommandModel* command;
  std::vector<const OptionModel*> options;
};
// All commands, the program first.
std::vector<CompletedCommand> completed_commands(const CommandModel& program);

}  // namespace relmap::terminal
