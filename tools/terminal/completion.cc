#include "tools/terminal/completion.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "tools/terminal/command_model.h"

namespace relmap::terminal {

namespace {

void add_completed(const CommandModel& command, const std::vector<const OptionModel*>& inherited,
                   std::vector<CompletedCommand>& all) {
  CompletedCommand completed{&command, {}};
  for (const OptionModel& option : command.options) completed.options.push_back(&option);
  for (const OptionModel* option : inherited) {
    const auto same = [&](const OptionModel* own) { return own->names.back() == option->names.back(); };
    if (std::none_of(completed.options.begin(), completed.options.end(), same)) completed.options.push_back(option);
  }
  const std::vector<const OptionModel*> below =
      command.inherited ? completed.options : std::vector<const OptionModel*>();
  all.push_back(std::move(completed));
  for (const CommandModel& deeper : command.commands) add_completed(deeper, below, all);
}

}  // namespace

const std::vector<std::string>& shell_names() {
  static const std::vector<std::string> names{"bash", "zsh", "fish"};  // in the order of Shell
  return names;
}

std::optional<Shell> shell_of(const std::string& name) {
  const auto found = std::find(shell_names().begin(), shell_names().end(), name);
  if (found == shell_names().end()) return std::nullopt;
  return static_cast<Shell>(std::distance(shell_names().begin(), found));
}

std::string completion(const CLI::App& app, Shell shell) {
  const CommandModel program = model_of(app);
  switch (shell) {
    case Shell::kBash:
      return bash_completion(program);
    case Shell::kZsh:
      return zsh_completion(program);
    case Shell::kFish:
      return fish_completion(program);
  }
  return "";
}

std::string place_of(const CommandModel& command) {
  std::string place;
  for (std::size_t i = 1; i < command.path.size(); ++i) place += "/" + command.path[i];
  return place;
}

std::string shell_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::vector<CompletedCommand> completed_commands(const CommandModel& program) {
  std::vector<CompletedCommand> all;
  add_completed(program, {}, all);
  return all;
}

}  // namespace relmap::terminal
