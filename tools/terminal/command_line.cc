#include "tools/terminal/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <ostream>
#include <string_view>
#include <utility>

#include "proto/base/version.h"
#include "tools/terminal/completion.h"
#include "tools/terminal/manual_page.h"

namespace relmap::terminal {

namespace {

constexpr std::size_t kMaxMeant = 3;
constexpr std::size_t kMinBeginning = 3;  // letters

// Thrown, like CLI11's own answers to --help and --version, before anything is required.
constexpr const char* kPrintText = "PrintText";
class PrintText : public CLI::Success {
 public:
  explicit PrintText(std::string text) : Success(kPrintText, std::move(text), CLI::ExitCodes::Success) {}
};

// Damerau-Levenshtein distance: letters left out, added or changed, and neighbours swapped.
std::size_t slips(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

// The subcommand that was parsed last, with its full name.
struct Reached {
  std::vector<const CLI::App*> chain;  // the program first
  std::string name;
};
Reached reached(const CLI::App& app) {
  Reached found{{&app}, app.get_name()};
  for (auto below = app.get_subcommands(); !below.empty(); below = below.back()->get_subcommands()) {
    found.chain.push_back(below.back());
    found.name += " " + below.back()->get_name();
  }
  return found;
}

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

std::vector<std::string> options_of(const Reached& where) {
  std::vector<std::string> names;
  for (const CLI::App* app : where.chain)
    for (const CLI::Option* option : app->get_options())
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::string listed(const std::vector<std::string>& names, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : i + 1 == names.size() ? last : ", ") + names[i];
  return text;
}

// A message about the first unexpected word and what it may have been meant to be; empty if there is no such word.
std::string slip_in(const CLI::App& app) {
  const std::vector<std::string> rest = app.remaining(true);
  if (rest.empty()) return "";
  const Reached where = reached(app);
  const std::string word = rest.front().substr(0, rest.front().find('='));
  const bool option = word.size() > 1 && word.front() == '-';
  const std::vector<std::string> known = option ? options_of(where) : commands_of(*where.chain.back());
  if (!option && known.empty()) return "";
  const std::vector<std::string> meant = likely_meant(word, known);
  std::string text = where.name + " has no " + (option ? "option" : "command") + " '" + word + "'.";
  if (!meant.empty()) return text + " Did you mean " + listed(meant, " or ") + "?";
  return option ? text : text + " It has " + listed(known, " and ") + ".";
}

// "0.100000" as "0.1", "3600.000000" as "3600".
std::string without_zeros(const std::string& number) {
  if (number.find('.') == std::string::npos) return number;
  const std::string kept = number.substr(0, number.find_last_not_of('0') + 1);
  return kept.ends_with('.') ? kept.substr(0, kept.size() - 1) : kept;
}

// CLI11 calls a word that is no number "not in range", and prints bounds with all digits: hundreds where there is no
// bound. Returns a better message; empty if that is not the error.
std::string range_slip_in(const CLI::ParseError& error) {
  const std::string what = error.what();
  constexpr std::string_view kValue = "Value ", kOutside = " not in range ", kTo = " to ";
  constexpr double kUnbounded = 1e300;
  const std::size_t value = what.find(kValue), outside = what.find(kOutside);
  if (value == std::string::npos || outside == std::string::npos || outside < value) return "";
  const std::string given = what.substr(value + kValue.size(), outside - value - kValue.size());
  double number = 0, highest = 0;
  if (!CLI::detail::lexical_cast(given, number)) return what.substr(0, value) + "'" + given + "' is not a number";
  const std::size_t lower = outside + kOutside.size(), to = what.find(kTo, lower);
  if (to == std::string::npos) return "";
  const std::string upper = what.substr(to + kTo.size());
  if (!CLI::detail::lexical_cast(upper, highest)) return "";
  if (highest > kUnbounded)
    return what.substr(0, outside) + (number < 0 ? " must not be negative" : " must be greater than 0");
  return what.substr(0, lower) + without_zeros(what.substr(lower, to - lower)) + std::string(kTo) +
         without_zeros(upper);
}

}  // namespace

std::vector<std::string> likely_meant(const std::string& typed, const std::vector<std::string>& known) {
  const std::size_t dashes = std::min(typed.find_first_not_of('-'), typed.size());
  const std::size_t letters = typed.size() - dashes;
  std::vector<std::pair<std::size_t, std::string>> found;
  for (const std::string& name : known) {
    const std::size_t wrong = slips(typed, name);
    const bool begun = letters >= kMinBeginning && name.starts_with(typed);
    if (begun || wrong <= std::max<std::size_t>(1, letters / 3)) found.emplace_back(begun ? 1 : wrong, name);
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::vector<std::string> names;
  for (const auto& [wrong, name] : found)
    if (names.size() < kMaxMeant) names.push_back(name);
  return names;
}

void add_standard_options(CLI::App& app) {
  app.set_version_flag("--version", version_line(), "Print the version and exit");
  app.add_flag_callback(
         "--manual", [&app] { throw PrintText(manual_page(app)); }, "Print the manual page and exit")
      ->group("");
  app.add_option_function<std::string>(
         "--completion", [&app](const std::string& shell) { throw PrintText(completion(app, *shell_of(shell))); },
         "Print the completion for a shell and exit")
      ->type_name("SHELL")
      ->check(CLI::IsMember(shell_names()))
      ->group("");
}

int end_with(const CLI::App& app, const CLI::ParseError& error, std::ostream& out, std::ostream& err, int usage) {
  if (error.get_name() == kPrintText) {
    out << error.what();
    return 0;
  }
  if (error.get_exit_code() == 0) return app.exit(error, out, err);
  // A mistyped word also makes the intended one missing; what was meant is the more useful message.
  const bool unexpected = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
                          error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
  const std::string slip = unexpected ? slip_in(app) : range_slip_in(error);
  err << (slip.empty() ? error.what() : slip) << "\nRun " << reached(app).name << " --help for more information.\n";
  return usage;
}

}  // namespace relmap::terminal
