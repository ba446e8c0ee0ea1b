#include "tools/terminal/manual_page.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/base/version.h"
#include "tools/terminal/command_model.h"
#include "tools/terminal/footer.h"
#include "tools/terminal/roff.h"

namespace relmap::terminal {

namespace {

constexpr std::size_t kMaxWordsWidth = 48;  // of the words that a value may be, in the line of the option's name

// The programs that have a page, and its section.
const std::map<std::string, int> kPages = {{"relmap", 1},         {"relmap-admin", 8},    {"relmap-camera", 1},
                                           {"relmap-console", 1}, {"relmap-frontend", 1}, {"relmap-sim", 1},
                                           {"relmap-vocab", 1},   {"relmapd", 8}};

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

// A phrase as a sentence. A first word that is a name stays as it is.
std::string sentence(std::string text, const std::vector<std::string>& names = {}) {
  if (text.empty()) return text;
  std::string first = text.substr(0, text.find(' '));
  if (first.ends_with(',') || first.ends_with(';')) first.pop_back();
  const bool ordinary = std::all_of(first.begin(), first.end(), [](unsigned char c) { return std::islower(c) != 0; }) &&
                        std::find(names.begin(), names.end(), first) == names.end() && !first.starts_with("relmap");
  if (ordinary) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  if (std::string_view(".:!?").find(text.back()) == std::string_view::npos) text += '.';
  return text;
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : between) + words[i];
  return text;
}

bool shows_words(const OptionModel& option) {
  return !option.words.empty() && joined(option.words, "|").size() <= kMaxWordsWidth;
}

std::string value_text(const OptionModel& option) {
  if (option.flag()) return "";
  std::string text;
  if (shows_words(option)) {
    for (const std::string& word : option.words) text += (text.empty() ? "" : "|") + roff_bold(word);
  } else {
    text = roff_italic(option.words.empty() ? option.value : "WORD");
  }
  return " " + text + (option.repeated ? "..." : "");
}

std::string heading_of(const OptionModel& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.names) names.push_back(roff_bold(name));
  return joined(names, ", ") + value_text(option);
}

std::string argument_text(const OptionModel& positional) {
  const std::string text = roff_italic(positional.names.front()) + (positional.repeated ? "..." : "");
  return positional.required ? text : "[" + text + "]";
}

// What there is to know of an option beside what its help says.
std::string conditions_of(const OptionModel& option) {
  std::vector<std::string> all;
  if (!option.words.empty() && !shows_words(option)) all.push_back("one of " + joined(option.words, ", "));
  if (!option.bounds.empty()) all.push_back(option.bounds);
  if (option.required && option.variable.empty()) all.push_back("required");
  if (!option.fallback.empty()) all.push_back("default " + option.fallback);
  if (!option.variable.empty()) all.push_back("default $" + option.variable + (option.required ? "; required" : ""));
  if (!option.needs.empty()) all.push_back("needs " + joined(option.needs, ", "));
  if (!option.excludes.empty()) all.push_back("not with " + joined(option.excludes, ", "));
  return sentence(joined(all, "; "));
}

std::string entry_of(const std::string& heading, const OptionModel& option) {
  const std::string help = sentence(option.help, option.words), conditions = conditions_of(option);
  std::string text = ".TP\n" + heading + "\n" + roff_prose(help) + "\n";
  if (!conditions.empty()) text += roff_prose(conditions) + "\n";
  return text;
}

std::string entries_of(const CommandModel& command, bool with_help) {
  std::string text;
  for (const OptionModel& positional : command.positionals)
    text += entry_of(roff_italic(positional.names.front()) + (positional.repeated ? "..." : ""), positional);
  for (const OptionModel& option : command.options)
    if (with_help || option.names.back() != "--help") text += entry_of(heading_of(option), option);
  return text;
}

// "relmap route --from PLACE... [OPTION]..."
std::string usage_of(const CommandModel& command) {
  std::string text = roff_bold(command.full_name());
  for (const OptionModel& option : command.options)
    if (option.required && option.variable.empty()) text += " " + roff_bold(option.names.back()) + value_text(option);
  text += " [" + roff_italic("OPTION") + "]...";
  for (const OptionModel& positional : command.positionals) text += " " + argument_text(positional);
  if (!command.commands.empty()) text += " " + roff_italic("COMMAND") + " ...";
  return text + "\n";
}

std::string list_of(const FooterPart& list) {
  if (!list.commands.empty()) return roff_commands(list.commands);
  std::string text = ".PD 0\n";  // no lines between items, of which most are short
  for (const FooterItem& item : list.items) {
    text += ".TP\n" + roff_bold(item.term) + "\n";
    text += item.text.empty() ? "\\&\n" : roff_prose(item.text) + "\n";
  }
  return text + ".PD\n";
}

std::string paragraph_of(const std::string& text) { return ".PP\n" + roff_prose(text) + "\n"; }

// The footer of a command below its options.
std::string footer_of(const CommandModel& command) {
  std::string text;
  for (const FooterPart& part : parts_of(command.footer))
    text += !part.paragraph.empty() ? paragraph_of(part.paragraph)
                                    : ".PP\n" + roff_escaped(part.heading) + ":\n" +
                                          (part.commands.empty() ? ".RS 4\n" + list_of(part) + ".RE\n" : list_of(part));
  return text;
}

std::string commands_below(const CommandModel& command) {
  std::string text;
  for (const CommandModel& below : command.commands) {
    text += ".SS " + roff_escaped(joined({below.path.begin() + 1, below.path.end()}, " ")) + "\n";
    text += usage_of(below) + paragraph_of(sentence(below.description));
    text += entries_of(below, false) + footer_of(below) + commands_below(below);
  }
  return text;
}

void collect_variables(const CommandModel& command, std::vector<std::pair<std::string, std::string>>& found) {
  for (const OptionModel& option : command.options)
    if (!option.variable.empty()) found.emplace_back(option.variable, option.names.back());
  for (const CommandModel& below : command.commands) collect_variables(below, found);
}

std::string environment_of(const CommandModel& program) {
  std::vector<std::pair<std::string, std::string>> variables;
  collect_variables(program, variables);
  std::string text;
  for (const auto& [variable, option] : variables)
    text += ".TP\n" + roff_bold(variable) + "\n" + roff_prose("The default of " + option + ".") + "\n";
  return text;
}

// One line for whatis(1): "asks a relmap daemon ..."
std::string summary_of(const CommandModel& program) {
  std::string text = program.description;
  if (text.ends_with('.')) text.pop_back();
  if (text.size() > 1 && std::isupper(static_cast<unsigned char>(text[1])) == 0)
    text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string see_also(const std::string& name) {
  std::string text;
  for (const auto& [page, section] : kPages)
    if (page != name) text += (text.empty() ? "" : ", ") + roff_bold(page) + "(" + std::to_string(section) + ")";
  return text + "\n";
}

std::string section_of(const std::string& heading, const std::string& text) {
  return text.empty() ? "" : ".SH " + roff_escaped(heading) + "\n" + text;
}

}  // namespace

int manual_section(const std::string& program) {
  const auto page = kPages.find(program);
  return page == kPages.end() ? 1 : page->second;
}

std::string manual_page(const CLI::App& app) {
  const CommandModel program = model_of(app);
  const std::string& name = program.name();

  std::string description = roff_prose(sentence(program.description)) + "\n", lists, exit_codes, examples;
  for (const FooterPart& part : parts_of(program.footer)) {
    if (!part.paragraph.empty())
      (exit_codes.empty() ? description : exit_codes) += paragraph_of(part.paragraph);
    else if (part.heading == "Examples")
      examples += list_of(part);
    else if (part.heading == "Exit codes")
      exit_codes += list_of(part);
    else
      lists += section_of(upper(part.heading), list_of(part));
  }
  const std::string title = ".TH " + roff_escaped(upper(name)) + " " + std::to_string(manual_section(name)) + " \"" +
                            std::string(build_date()) + "\" \"relmap " + std::string(version()) + "\" \"relmap\"\n";
  const std::string text = title + ".nh\n.ad l\n" +
                           section_of("NAME", roff_escaped(name) + " \\- " + roff_escaped(summary_of(program)) + "\n") +
                           section_of("SYNOPSIS", usage_of(program)) + section_of("DESCRIPTION", description) +
                           section_of("OPTIONS", entries_of(program, true)) +
                           section_of("COMMANDS", commands_below(program)) + lists +
                           section_of("ENVIRONMENT", environment_of(program)) + section_of("EXIT STATUS", exit_codes) +
                           section_of("EXAMPLES", examples);
  const bool names_documents = text.find(".md") != std::string::npos;
  return text + section_of("SEE ALSO", see_also(name)) +
         (names_documents ? paragraph_of("Files that are named as docs/NAME.md belong to relmap's documents.") : "");
}

}  // namespace relmap::terminal
