#include <string>
#include <vector>

#include "tools/terminal/command_model.h"
#include "tools/terminal/completion.h"

namespace relmap::terminal {

namespace {

std::string escaped_for_arguments(const std::string& text, const std::string& special) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\' || special.find(c) != std::string::npos) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

// "MESSAGE:ACTION", as _arguments wants it behind an option or the number of an argument. A space is no action.
std::string message_and_action(const OptionModel& option, const std::string& message) {
  std::string action = " ";
  if (!option.words.empty()) {
    action.clear();
    for (const std::string& word : option.words) action += (action.empty() ? "(" : " ") + word;
    action += ")";
  } else if (option.takes_file()) {
    action = "_files";
  } else if (option.takes_folder()) {
    action = "_path_files -/";  // _files -/ falls back on files
  }
  return escaped_for_arguments(message, ":") + ":" + action;
}

// The options that are not offered any more behind this one.
std::string excluded_by(const OptionModel& option) {
  if (option.names.back() == "--help" || option.names.back() == "--version") return "(- *)";
  if (option.repeated) return "*";
  std::string names;
  for (const auto* list : {&option.names, &option.excludes})
    for (const std::string& name : *list) names += (names.empty() ? "" : " ") + name;
  return "(" + names + ")";
}

std::string line_for_arguments(const std::string& text) { return "    " + shell_quoted(text) + " \\\n"; }

std::string option_lines(const OptionModel& option) {
  std::string lines;
  for (const std::string& name : option.names) {
    const bool long_name = name.starts_with("--");
    std::string text = excluded_by(option) + name;
    if (!option.flag()) text += long_name ? "=" : "+";
    text += "[" + escaped_for_arguments(option.help, "[]") + "]";
    if (!option.flag()) text += ":" + message_and_action(option, option.value);
    lines += line_for_arguments(text);
  }
  return lines;
}

std::string function_of(const CommandModel& command) {
  std::string name;
  for (const std::string& word : command.path) name += "_" + word;
  return name;
}

// Offers the commands below this one, and hands over to the function of the one that was given.
std::string below_of(const CommandModel& command) {
  std::string text =
      "    '1: :->command' \\\n    '*:: :->argument' && return\n  case $state in\n    command)\n      local -a "
      "commands=(\n";
  for (const CommandModel& below : command.commands)
    text += "        " + shell_quoted(below.name() + ":" + below.description) + "\n";
  text += "      )\n      (( ${words[(I)--]} )) || _describe -t commands " +
          shell_quoted(command.full_name() + " command") +
          " commands\n      ;;\n    argument)\n      curcontext=${curcontext%:*}-$words[1]:\n      case $words[1] in\n";
  for (const CommandModel& below : command.commands)
    text += "        " + below.name() + ") " + function_of(below) + " ;;\n";
  return text + "      esac\n      ;;\n  esac\n";
}

std::string function_for(const CompletedCommand& completed) {
  const CommandModel& command = *completed.command;
  std::string text = function_of(command) +
                     "() {\n  local curcontext=$curcontext state line\n  typeset -A opt_args\n  _arguments -C -S \\\n";
  for (const OptionModel* option : completed.options) text += option_lines(*option);
  for (const OptionModel& argument : command.positionals) {
    const std::string& name = argument.names.front();
    text += line_for_arguments((argument.repeated   ? "*:"
                                : argument.required ? ":"
                                                    : "::") +
                               message_and_action(argument, name));
  }
  if (command.commands.empty())
    text += "    && return\n";
  else
    text += below_of(command);
  return text + "}\n\n";
}

}  // namespace

std::string zsh_completion(const CommandModel& program) {
  const std::string& name = program.name();
  std::string text =
      "#compdef " + name + "\n# zsh completion of " + name + ", written from its command line by --completion zsh\n\n";
  for (const CompletedCommand& completed : completed_commands(program)) text += function_for(completed);
  // Loaded by the completion system, this file is the body of the function; otherwise it is sourced.
  const std::string function = function_of(program);
  return text + "if [[ $funcstack[1] == " + function + " ]]; then\n  " + function + " \"$@\"\nelse\n  compdef " +
         function + " " + name + "\nfi\n";
}

}  // namespace relmap::terminal
