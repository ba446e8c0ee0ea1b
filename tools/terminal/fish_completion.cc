#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tools/terminal/command_model.h"
#include "tools/terminal/completion.h"

namespace relmap::terminal {

namespace {

// Functions that tell which command the words before the cursor name: "/session/freeze", and " --" behind it if what
// follows are no options any more.
constexpr char kFunctions[] = R"(function NAME_at --description 'Print the command that is being completed'
    set -l at
    set -l option
    set -l words (commandline -opc)
    set -e words[1]
    for word in $words
        if test -n "$option"
            set option
            continue
        end
        switch "$word"
            case --
                echo "$at --"
                return
            case '-*'
                switch "$at $word"
                    case VALUED
                        set option $word
                end
            case '*'
                switch "$at/$word"
                    case COMMANDS
                        set at "$at/$word"
                end
        end
    end
    echo "$at"
end

function NAME_is --description 'Whether one of these commands is being completed'
    contains -- (NAME_at) $argv
end

function NAME_under --description 'Whether this command, or one below it, is being completed'
    string match -q -- "$argv[1]*" (NAME_at)
end

)";

std::string fish_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "'";
}

std::string functions_for(const std::string& function, const std::string& valued, const std::string& commands) {
  std::string text = kFunctions;
  for (const auto& [mark, value] :
       {std::pair("NAME", function), std::pair("VALUED", valued), std::pair("COMMANDS", commands)})
    for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += value.size())
      text.replace(at, std::string(mark).size(), value.empty() ? "''" : value);
  return text;
}

// What may follow as a value; empty: nothing is known of it.
std::string value_arguments(const OptionModel& option) {
  std::string words;
  for (const std::string& word : option.words) words += (words.empty() ? "" : " ") + word;
  if (!words.empty()) return " -a " + fish_quoted(words);
  if (option.takes_file()) return " -F";
  return option.takes_folder() ? " -a '(__fish_complete_directories)'" : "";
}

std::string option_arguments(const OptionModel& option) {
  std::string text;
  for (const std::string& name : option.names)
    text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  if (!option.flag()) text += (option.takes_file() && option.words.empty() ? " -r" : " -x") + value_arguments(option);
  return text + " -d " + fish_quoted(option.help);
}

}  // namespace

std::string fish_completion(const CommandModel& program) {
  const std::string function = "__" + program.name(), complete = "complete -c " + program.name();
  std::string valued, commands, lines = complete + " -f\n";
  for (const auto& [command, completed] : completed_commands(program)) {
    const std::string at = place_of(*command);
    if (!at.empty()) commands += (commands.empty() ? "" : " ") + fish_quoted(at);
    for (const OptionModel* option : completed)
      for (const std::string& name : option->names)
        if (!option->flag()) valued += (valued.empty() ? "" : " ") + fish_quoted(at + " " + name);

    const auto when = [&](const char* condition, const std::string& places) {
      return complete + " -n " + fish_quoted(function + condition + places);
    };
    for (const OptionModel& option : command->options) {
      const bool help = option.names.back() == "--help";
      if (help && !at.empty()) continue;  // every command has it
      lines += (help ? complete : when(command->inherited ? "_under " : "_is ", "\"" + at + "\"")) +
               option_arguments(option) + "\n";
    }
    for (const CommandModel& below : command->commands)
      lines += when("_is ", "\"" + at + "\"") + " -a " + fish_quoted(below.name()) + " -d " +
               fish_quoted(below.description) + "\n";
    for (const OptionModel& argument : command->positionals)
      if (const std::string values = value_arguments(argument); !values.empty())
        lines += when("_is ", "\"" + at + "\" \"" + at + " --\"") + values + "\n";
  }
  return "# fish completion of " + program.name() + ", written from its command line by --completion fish\n\n" +
         functions_for(function, valued, commands) + lines;
}

}  // namespace relmap::terminal
