#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tools/terminal/command_model.h"
#include "tools/terminal/completion.h"

namespace relmap::terminal {

namespace {

// The script walks along the words before the cursor: `at` is the command that they name, `option` an option whose
// value comes next, `places` the number of arguments without an option, and `ended` is set behind "--". Readline
// divides
// --option=value into three words.
constexpr char kWalk[] = R"(
  for ((i = 1; i < COMP_CWORD; ++i)); do
    word=${COMP_WORDS[i]}
    if [[ -n $ended ]]; then
      ((++places))
    elif [[ $word == = ]]; then
      continue
    elif [[ -n $option ]]; then
      option=
    elif [[ $word == -- ]]; then
      ended=yes
    elif [[ $word == -* ]]; then
      case "$at $word" in
        VALUED) option=$word ;;
      esac
    else
      case "$at/$word" in
        COMMANDS) at+=/$word places=0 ;;
        *) ((++places)) ;;
      esac
    fi
  done
)";

constexpr char kEnd[] = R"(
  case $kind in
    files)
      compopt -o filenames 2>/dev/null
      mapfile -t COMPREPLY < <(compgen -f -- "$current")
      ;;
    folders)
      compopt -o filenames 2>/dev/null
      mapfile -t COMPREPLY < <(compgen -d -- "$current")
      ;;
    words) mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current") ;;
  esac
}
)";

std::string words_in(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

// What sets `kind` and `words` for a value; empty: nothing is known of it.
std::string kind_of(const OptionModel& option) {
  if (!option.words.empty()) return "kind=words words=" + shell_quoted(words_in(option.words));
  if (option.takes_file()) return "kind=files";
  return option.takes_folder() ? "kind=folders" : "";
}

std::string case_line(const std::string& pattern, const std::string& commands) {
  return "      " + pattern + ") " + commands + " ;;\n";
}

// Alternatives of one pattern; a pattern that nothing matches if there are none.
void add_alternative(std::string& pattern, const std::string& text) {
  pattern += (pattern.empty() ? "" : " | ") + shell_quoted(text);
}

std::string walk_with(const std::string& valued, const std::string& commands) {
  std::string walk = kWalk;
  for (const auto& [mark, pattern] : {std::pair("VALUED", valued), std::pair("COMMANDS", commands)})
    walk.replace(walk.find(mark), std::string(mark).size(), pattern.empty() ? "''" : pattern);
  return walk;
}

}  // namespace

std::string bash_completion(const CommandModel& program) {
  std::string valued, commands, values, options, below, arguments;
  for (const auto& [command, completed] : completed_commands(program)) {
    const std::string at = place_of(*command);
    if (!at.empty()) add_alternative(commands, at);
    std::string names;
    for (const OptionModel* option : completed)
      for (const std::string& name : option->names) {
        names += (names.empty() ? "" : " ") + name;
        if (option->flag()) continue;
        add_alternative(valued, at + " " + name);
        if (const std::string kind = kind_of(*option); !kind.empty())
          values += case_line(shell_quoted(at + " " + name), kind);
      }
    options += case_line(shell_quoted(at), "words=" + shell_quoted(names));
    if (!command->commands.empty()) {
      std::vector<std::string> deeper;
      for (const CommandModel& each : command->commands) deeper.push_back(each.name());
      below += case_line(shell_quoted(at), "kind=words words=" + shell_quoted(words_in(deeper)));
    }
    for (std::size_t i = 0; i < command->positionals.size(); ++i) {
      const OptionModel& argument = command->positionals[i];
      const std::string place =
          argument.repeated ? shell_quoted(at + " ") + "*" : shell_quoted(at + " " + std::to_string(i));
      if (const std::string kind = kind_of(argument); !kind.empty()) arguments += case_line(place, kind);
    }
  }
  const std::string function = "_" + program.name();
  return "# bash completion of " + program.name() + ", written from its command line by --completion bash\n\n" +
         function +
         "() {\n  local word at= option= ended= kind= words=\n  local -i i places=0\n"
         "  local current=${COMP_WORDS[COMP_CWORD]}\n  [[ $current == = ]] && current=\n  COMPREPLY=()" +
         walk_with(valued, commands) + "\n  if [[ -n $option ]]; then\n    case \"$at $option\" in\n" + values +
         "    esac\n  elif [[ -z $ended && $current == -* ]]; then\n    kind=words\n    case $at in\n" + options +
         "    esac\n  else\n    case \"$at $places\" in\n" + arguments +
         "    esac\n    [[ -z $ended && $places == 0 ]] && case $at in\n" + below + "    esac\n  fi\n" + kEnd +
         "\ncomplete -F " + function + " " + program.name() + "\n";
}

}  // namespace relmap::terminal
