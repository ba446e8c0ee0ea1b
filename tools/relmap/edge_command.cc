// What an operator does to loop closures.
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "tools/relmap/commands.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

struct EditOptions {
  std::string id;    // of a closure
  std::string a, b;  // frames
  bool accept = false;
  client::EditOptions how;
};

std::string standing(const std::optional<client::EdgeState>& state, Reason reason) {
  return state ? std::string(name_of(*state)) + ", " + std::string(reason_name(reason)) : "not there";
}

const char* in_graph(const client::ClosureChange& change) {
  if (change.edge_before == change.edge_after) return change.edge_after ? "stays an edge" : "no edge";
  return change.edge_after ? "edge comes" : "edge goes";
}

void print(const client::EdgeEdit& edit, const std::string& undo, Console& console) {
  std::ostream& out = console.out();
  out << edit.edge.id.to_string() << (edit.done ? ": " : " would be: ") << name_of(edit.edge.state) << ", "
      << reason_name(edit.edge.reason) << " (" << explanation(edit.edge.reason) << ")\n";
  std::vector<std::vector<std::string>> rows;
  for (const client::ClosureChange& change : edit.effect.closures)
    rows.push_back({change.id.to_string(), change.a.to_string(), change.b.to_string(),
                    standing(change.before, change.reason_before), standing(change.after, change.reason_after),
                    in_graph(change), std::to_string(change.bound), std::to_string(change.bound_frames)});
  if (!rows.empty())
    console.table({"closure", "from", "to", edit.done ? "was" : "is", edit.done ? "is" : "would be", "in the graph",
                   ">binds", ">in frames"},
                  rows);
  for (const client::CarriedStretch& stretch : edit.effect.carried)
    out << "the robot counts as carried: " << stretch_text(stretch) << '\n';
  for (const client::CarriedStretch& stretch : edit.effect.not_carried)
    out << "the robot does not count as carried any more: " << stretch_text(stretch) << '\n';
  if (edit.done) console.err() << "to undo it: " << undo << '\n';
}

struct Verb {
  const char* name;
  const char* help;
  client::EdgeAction action;
  const char* undone_by;
};
constexpr Verb kVerbs[] = {
    {"remove", "take it out, with those that agree with it and all that they bound", client::EdgeAction::kRemove,
     "restore"},
    {"restore", "put back what was taken out, with what went with it, as it was", client::EdgeAction::kRestore,
     "remove"},
    {"accept", "put it into force, whatever it is: it is never outvoted, and what cannot stand beside it goes",
     client::EdgeAction::kAccept, "withdraw"},
    {"withdraw", "take an acceptance back: it, and what it put out, are what they were", client::EdgeAction::kWithdraw,
     "accept"},
};

void add_how(CLI::App& command, client::EditOptions& how) {
  command.add_option("--note", how.note, "why, for the journal");
  command.add_flag("--dry-run", how.dry_run, "say what would change, and change nothing");
}

void add_verb(CLI::App& edge, const Verb& verb, Action& action) {
  auto* command = edge.add_subcommand(verb.name, verb.help);
  auto options = std::make_shared<EditOptions>();
  command->add_option("ID", options->id, "session:index/ordinal")->required();
  add_how(*command, options->how);
  command->callback([&action, options, &verb] {
    action = [options, &verb](client::Client& client, Console& console) -> Status {
      const auto id = edge_id(options->id);
      if (!id.ok()) return id.status();
      const auto edit = client.edit_edge(*id, verb.action, options->how);
      if (!edit.ok()) return edit.status();
      if (!console.json) print(*edit, std::string("relmap edge ") + verb.undone_by + " " + id->to_string(), console);
      return {};
    };
  });
}

void add_propose(CLI::App& edge, Action& action) {
  auto* command = edge.add_subcommand("propose", "try geometry between two frames, and enter what it finds");
  auto options = std::make_shared<EditOptions>();
  command->add_option("A", options->a, "frame, session:index")->required();
  command->add_option("B", options->b, "another, at the same place")->required();
  command->add_flag("--accept", options->accept, "put it into force at once");
  add_how(*command, options->how);
  command->footer(
      "It is judged like any other: a candidate until another one agrees, unless --accept. The note goes with "
      "--accept.");
  command->callback([&action, options] {
    action = [options](client::Client& client, Console& console) -> Status {
      const auto a = parse_frame(options->a), b = parse_frame(options->b);
      if (!a.ok()) return a.status();
      if (!b.ok()) return b.status();
      const auto edit = client.propose_edge(*a, *b, options->accept, options->how);
      if (!edit.ok()) return edit.status();
      if (console.json) return {};
      const std::string id = edit->edge.id.to_string();
      print(*edit, (options->accept ? "relmap edge withdraw " + id + ", and " : "") + "relmap edge remove " + id,
            console);
      return {};
    };
  });
}

}  // namespace

void add_edge(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("edge", "changes loop closures: out of the map, back in, into force, new ones");
  command->require_subcommand(1);
  for (const Verb& verb : kVerbs) add_verb(*command, verb, action);
  add_propose(*command, action);
  command->footer(
      "Examples:\n"
      "  relmap edge remove 3:120/1 --dry-run\n"
      "  relmap edge remove 3:120/1 --note 'that is the other hall'\n"
      "  relmap edge restore 3:120/1\n"
      "  relmap edge accept 5:77/2 --note 'I was there'\n"
      "  relmap edge propose 2:17 5:77 --accept\n"
      "Each edit says what it changed, and the command that undoes it.");
}

}  // namespace relmap::cli
