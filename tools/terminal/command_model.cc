#include "tools/terminal/command_model.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <initializer_list>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

namespace relmap::terminal {

namespace {

constexpr double kUnbounded = 1e18;

std::vector<std::string> divided(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  return parts;
}

std::string in_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// CLI11 gives the name of the value and what is checked of it as one text, "TEXT:{a,b}" or "FLOAT:FLOAT in [0 - 1]".
void set_value(OptionModel& option, const std::string& type) {
  static const std::regex checked(
      R"(^(.*?):(?:\{(.*)\}|(POSITIVE)|(NONNEGATIVE)|(SIZE) .*|\w+ in \[(\S+) - (\S+)\])$)");
  std::smatch found;
  option.value = type;
  if (std::regex_match(type, found, checked)) {
    option.value = found[5].matched ? "SIZE" : found[1].str();
    option.words = divided(found[2], ',');
    if (found[3].matched) option.bounds = "more than 0";
    if (found[4].matched) option.bounds = "at least 0";
    if (found[6].matched)
      option.bounds =
          std::stod(found[7]) < kUnbounded ? found[6].str() + " to " + found[7].str() : "at least " + found[6].str();
  }
  if (option.value == "INT" || option.value == "UINT" || option.value == "FLOAT") option.value = "NUMBER";
}

std::string long_name(const CLI::Option& option) {
  if (!option.get_lnames().empty()) return "--" + option.get_lnames().front();
  return option.get_snames().empty() ? option.get_name(true) : "-" + option.get_snames().front();
}

// In the order of their names, since CLI11 keeps a set of pointers.
std::vector<std::string> names_of(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(long_name(*option));
  std::sort(names.begin(), names.end());
  return names;
}

OptionModel model_of_option(const CLI::Option& defined) {
  OptionModel option;
  if (defined.get_positional()) {
    option.names.push_back(defined.get_name(true));
  } else {
    for (const std::string& name : defined.get_snames()) option.names.push_back("-" + name);
    for (const std::string& name : defined.get_lnames()) option.names.push_back("--" + name);
  }
  option.help = in_one_line(defined.get_description());
  if (defined.get_expected_max() > 0) {
    set_value(option, defined.get_type_name());
    option.fallback = defined.get_default_str();
  }
  option.variable = defined.get_envname();
  option.needs = names_of(defined.get_needs());
  option.excludes = names_of(defined.get_excludes());
  option.required = defined.get_required();
  option.repeated = !option.flag() && (defined.get_expected_max() > 1 ||
                                       defined.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll);
  return option;
}

CommandModel model_below(const CLI::App& app, std::vector<std::string> path) {
  CommandModel command;
  command.path = std::move(path);
  command.description = in_one_line(app.get_description());
  command.footer = app.get_footer();
  command.inherited = app.get_fallthrough();
  for (const CLI::Option* defined : app.get_options([](const CLI::Option*) { return true; })) {
    if (defined->get_group().empty()) continue;
    (defined->get_positional() ? command.positionals : command.options).push_back(model_of_option(*defined));
  }
  for (const CLI::App* below : app.get_subcommands([](const CLI::App* each) { return !each->get_group().empty(); })) {
    std::vector<std::string> deeper = command.path;
    deeper.push_back(below->get_name());
    command.commands.push_back(model_below(*below, std::move(deeper)));
  }
  return command;
}

bool has_alternative(const std::string& value, std::initializer_list<std::string_view> names) {
  for (const std::string& alternative : divided(value, '|'))
    if (std::find(names.begin(), names.end(), alternative) != names.end()) return true;
  return false;
}

}  // namespace

bool OptionModel::takes_file() const { return has_alternative(value, {"FILE", "PICTURE", "PATH"}); }
bool OptionModel::takes_folder() const { return has_alternative(value, {"DIR", "FOLDER"}); }

std::string CommandModel::full_name() const {
  std::string text;
  for (const std::string& word : path) text += (text.empty() ? "" : " ") + word;
  return text;
}

CommandModel model_of(const CLI::App& app) { return model_below(app, {app.get_name()}); }

}  // namespace relmap::terminal
