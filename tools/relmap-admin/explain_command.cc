#include <cctype>
#include <memory>
#include <utility>

#include "tools/relmap-admin/commands.h"
#include "tools/relmap-admin/runbook.h"
#include "tools/terminal/command_line.h"
#include "tools/terminal/plain_text.h"

namespace relmap::admin {

namespace {

constexpr std::size_t kColumns = 80;

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

Json json_of(const Explanation& explanation) {
  return Json()
      .add("name", explanation.name)
      .add("kind", explanation.is_alert() ? "alert" : "reason")
      .add("group", explanation.group)
      .add("text", explanation.text);
}

void print(const std::vector<Explanation>& found, terminal::Console& console) {
  bool first = true;
  for (const Explanation& explanation : found) {
    if (!std::exchange(first, false)) console.out() << '\n';
    console.out() << terminal::plain_text(explanation.text, kColumns);
  }
}

// Where to look first, and the names of all explanations below their groups.
void print_all(const Runbook& runbook, terminal::Console& console) {
  console.out() << terminal::plain_text(runbook.first_look, kColumns);
  std::string group, names;
  const auto print_group = [&] {
    if (!names.empty()) console.out() << '\n' << terminal::plain_text("## " + group + "\n" + names, kColumns);
    names.clear();
  };
  for (const Explanation& explanation : runbook.explanations) {
    if (explanation.group != group) print_group();
    group = explanation.group;
    names += explanation.name + ' ';
  }
  print_group();
  console.out() << "\nrelmap-admin explain NAME... tells what each means and what to do.\n";
}

// INVALID_ARGUMENT: the runbook has no such name; with those that may have been meant.
Result<Explanation> explanation_of(const Runbook& runbook, const std::string& name) {
  std::vector<std::string> known;
  for (const Explanation& explanation : runbook.explanations) {
    if (lower(explanation.name) == lower(name)) return explanation;
    known.push_back(lower(explanation.name));
  }
  std::string meant;
  for (const std::string& likely : terminal::likely_meant(lower(name), known))
    for (const Explanation& explanation : runbook.explanations)
      if (lower(explanation.name) == likely) meant += (meant.empty() ? "" : " or ") + explanation.name;
  return Status(Reason::INVALID_ARGUMENT,
                "there is neither a reason nor an alert '" + name + "'" +
                    (meant.empty() ? "; relmap-admin explain lists all" : "; did you mean " + meant + "?"));
}

Answer explain(const std::vector<std::string>& names, Context& context) {
  const Runbook runbook = read_runbook();
  std::vector<Explanation> found;
  for (const std::string& name : names) {
    auto explanation = explanation_of(runbook, name);
    if (!explanation.ok()) return {explanation.status(), false, {}};
    found.push_back(*std::move(explanation));
  }
  Answer answer;
  std::vector<Json> documents;
  for (const Explanation& explanation : names.empty() ? runbook.explanations : found)
    documents.push_back(json_of(explanation));
  answer.json.add("explanations", documents);
  if (context.console.json) return answer;
  if (names.empty())
    print_all(runbook, context.console);
  else
    print(found, context.console);
  return answer;
}

}  // namespace

void add_explain(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("explain", "tell what a reason or an alert means, and what to do");
  auto names = std::make_shared<std::vector<std::string>>();
  command->add_option("NAME", *names, "reasons (DISK_FULL) and alerts (RelmapDown), in any case; none: list all");
  command->footer(R"(
It is the text of docs/runbook.md, and needs neither a daemon nor a map.

Examples:
  relmap-admin explain
  relmap-admin explain DISK_FULL read_only
  relmap-admin explain RelmapRestarting
  relmap-admin --json explain DISK_FULL | jq -r .explanations[].text)");
  command->callback([&action, names] { action = [names](Context& context) { return explain(*names, context); }; });
}

}  // namespace relmap::admin
