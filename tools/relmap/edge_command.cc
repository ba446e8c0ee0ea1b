// relmap edge: an operator's edits of loop closures.
#include <algorithm>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "tools/relmap/commands.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/typed_text.h"
#include "tools/relmap/view_options.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kMaxShown = 20;  // closures in the table above a question, which must stay on the screen
constexpr std::size_t kMaxNamed = 8;   // closures in one line

struct EditOptions {
  std::string id;    // of a closure
  std::string a, b;  // frames
  bool accept = false;
  bool yes = false, only_this = false;  // for a removal
  client::EditOptions how;
};

std::string standing(const std::optional<client::EdgeState>& state, Reason reason) {
  return state ? std::string(name_of(*state)) + ", " + std::string(reason_name(reason)) : "not there";
}

const char* edge_change_text(const client::ClosureChange& change) {
  if (change.edge_before == change.edge_after) return change.edge_after ? "stays an edge" : "no edge";
  return change.edge_after ? "edge comes" : "edge goes";
}

// Every edit decides anew which closures in force are edges of the graph and which only bind landmarks, so a restored
// set may have other edges than before.
void print_in_force(const client::EdgeEdit& edit, std::ostream& out) {
  std::vector<EdgeId> in_force, edges;
  for (const client::ClosureChange& change : edit.effect.closures) {
    if (change.after == client::EdgeState::kAccepted && change.before != change.after) in_force.push_back(change.id);
    if (change.edge_after && !change.edge_before) edges.push_back(change.id);
  }
  if (!in_force.empty())
    out << (edit.done ? "came into force:" : "would come into force:") << ids_text(in_force, kMaxNamed) << '\n';
  if (!edges.empty())
    out << (edit.done ? "edges of the graph since:" : "would become edges of the graph:") << ids_text(edges, kMaxNamed)
        << '\n';
  else if (!in_force.empty())
    out << (edit.done ? "none of them is an edge of the graph" : "none of them would be an edge of the graph")
        << ": they bind landmarks\n";
}

// Prints at most `max_closures` of the closures; 0: all.
void print_effect(const client::EdgeEdit& edit, std::size_t max_closures, terminal::Console& console) {
  std::ostream& out = console.out();
  out << edit.edge.id.to_string() << (edit.done ? ": " : " would be: ") << name_of(edit.edge.state) << ", "
      << reason_name(edit.edge.reason) << " (" << explanation(edit.edge.reason) << ")\n";
  std::vector<std::vector<std::string>> rows;
  for (const client::ClosureChange& change : edit.effect.closures) {
    if (max_closures > 0 && rows.size() == max_closures) break;
    rows.push_back({change.id.to_string(), change.a.to_string(), change.b.to_string(),
                    standing(change.before, change.reason_before), standing(change.after, change.reason_after),
                    edge_change_text(change), std::to_string(change.bound), std::to_string(change.bound_frames)});
  }
  if (!rows.empty())
    console.table({"closure", "from", "to", edit.done ? "was" : "is", edit.done ? "is" : "would be", "in the graph",
                   ">binds", ">in frames"},
                  rows);
  if (rows.size() < edit.effect.closures.size())
    out << "... and " << edit.effect.closures.size() - rows.size() << " more (--dry-run lists all)\n";
  print_in_force(edit, out);
  for (const client::CarriedStretch& stretch : edit.effect.carried)
    out << "the robot counts as carried: " << stretch_text(stretch.first, stretch.last) << '\n';
  for (const client::CarriedStretch& stretch : edit.effect.not_carried)
    out << "the robot does not count as carried any more: " << stretch_text(stretch.first, stretch.last) << '\n';
}

void print(const client::EdgeEdit& edit, const std::string& undo, terminal::Console& console) {
  print_effect(edit, 0, console);
  if (edit.done) console.err() << "to undo it: " << undo << '\n';
}

struct Verb {
  const char* name;
  const char* help;
  client::EdgeAction action;
  const char* undone_by;
};
constexpr Verb kVerbs[] = {
    {"restore", "undo a removal: the closure, and those removed with it, return to their former states",
     client::EdgeAction::kRestore, "remove"},
    {"accept", "put a closure into force for good: no vote takes it out, and closures that contradict it go",
     client::EdgeAction::kAccept, "withdraw"},
    {"withdraw", "undo an accept: the closure, and those that it put out of force, return to their former states",
     client::EdgeAction::kWithdraw, "accept"},
};

void add_how(CLI::App& command, client::EditOptions& how) {
  command.add_option("--note", how.note, "the reason for the edit, kept in the journal")->type_name("TEXT");
  command.add_flag("--dry-run", how.dry_run, "print what would change, and change nothing");
}

// The closures other than the named one that an edit takes out.
std::vector<EdgeId> others_out(const client::EdgeEdit& edit) {
  std::vector<EdgeId> others;
  for (const client::ClosureChange& change : edit.effect.closures)
    if (change.id != edit.edge.id && change.after == client::EdgeState::kRemoved && change.before != change.after)
      others.push_back(change.id);
  return others;
}

// A removal takes out all closures that agree with the named one. Shows them to the operator and asks; only what was
// shown may then be removed: returns its number for EditOptions::shown.
Result<std::uint64_t> confirm_removal(EdgeId id, const client::EditOptions& how, client::Client& client,
                                      terminal::Console& console) {
  client::EditOptions dry = how;
  dry.dry_run = true;
  const terminal::Console::Aside aside(console);
  const auto edit = client.edit_edge(id, client::EdgeAction::kRemove, dry);
  if (!edit.ok()) return edit.status();
  const std::vector<EdgeId> others = others_out(*edit);
  if (others.empty()) return edit->shown;
  const std::string name = id.to_string();
  const std::string which = others.size() == 1 ? "1 closure that agrees with " + name
                                               : std::to_string(others.size()) + " closures that agree with " + name;
  if (!terminal::can_ask())
    return Status(Reason::NOT_CONFIRMED, which + " would go with it:" + ids_text(others, kMaxNamed) +
                                             "; --yes takes all of them out, --only-this takes out " + name +
                                             " alone, --dry-run shows what would change");
  terminal::Console page(console.err(), console.err());
  print_effect(*edit, kMaxShown, page);
  if (Status meant =
          terminal::ask(console, "Take out " + name + " and " + which + "? (--only-this takes out " + name + " alone)");
      !meant.ok())
    return meant;
  return edit->shown;
}

Status remove(const EditOptions& options, client::Client& client, terminal::Console& console) {
  const auto id = edge_id(options.id);
  if (!id.ok()) return id.status();
  client::EditOptions how = options.how;
  if (!options.only_this && !options.yes && !how.dry_run && how.shown == 0) {
    const auto shown = confirm_removal(*id, how, client, console);
    if (!shown.ok()) return shown.status();
    how.shown = *shown;
  }
  const auto action = options.only_this ? client::EdgeAction::kRemoveAlone : client::EdgeAction::kRemove;
  const auto edit = client.edit_edge(*id, action, how);
  if (!edit.ok()) return edit.status();
  if (console.json) return {};
  print(*edit, "relmap edge restore " + id->to_string(), console);
  if (edit->shown != 0)
    console.err() << "to remove exactly this: relmap edge remove " << id->to_string() << " --shown " << edit->shown
                  << '\n';
  return {};
}

void add_remove(CLI::App& edge, Action& action) {
  auto* command = edge.add_subcommand("remove", "take a closure out of the map, with the closures that agree with it");
  auto options = std::make_shared<EditOptions>();
  command->add_option("ID", options->id, "session:index/ordinal")->required()->check(parsed_by(edge_id));
  auto* const only_this = command->add_flag("--only-this", options->only_this,
                                            "remove this one alone: those that agree with it stay in force");
  auto* const yes = command->add_flag("--yes", options->yes, "do not ask: remove whatever agrees with it by now")
                        ->excludes(only_this);
  command
      ->add_option("--shown", options->how.shown,
                   "do not ask: remove exactly what the --dry-run with this number showed")
      ->check(CLI::PositiveNumber)
      ->excludes(only_this)
      ->excludes(yes);
  add_how(*command, options->how);
  command->footer(
      "Closures that agree with a wrong one are as wrong, so they are removed with it, and so is all that they bound.\n"
      "On a terminal the command shows them and asks. Elsewhere it is refused (NOT_CONFIRMED, exit code 1) unless\n"
      "--yes, --shown or --only-this is given. If no other closure goes, nothing is asked. If the set has changed "
      "since\n"
      "it was shown, nothing is changed (WRONG_STATE): run the command again.\n"
      "Examples:\n"
      "  relmap edge remove 3:120/1 --dry-run   # what would change, and its number for --shown\n"
      "  relmap edge remove 3:120/1 --yes --note 'that is the other hall'\n"
      "  relmap edge remove 3:120/1 --only-this");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) {
      return remove(*options, client, console);
    };
  });
}

// The command that undoes an edit. A closure that was removed alone is removed alone again.
std::string undo_of(const Verb& verb, const client::EdgeEdit& edit) {
  const bool went_alone =
      std::any_of(edit.effect.closures.begin(), edit.effect.closures.end(), [&](const client::ClosureChange& change) {
        return change.id == edit.edge.id && change.reason_before == Reason::REMOVED_ALONE;
      });
  const bool removes = verb.action == client::EdgeAction::kRestore;
  return std::string("relmap edge ") + verb.undone_by + " " + edit.edge.id.to_string() +
         (removes && went_alone ? " --only-this" : "");
}

void add_verb(CLI::App& edge, const Verb& verb, Action& action) {
  auto* command = edge.add_subcommand(verb.name, verb.help);
  auto options = std::make_shared<EditOptions>();
  command->add_option("ID", options->id, "session:index/ordinal")->required()->check(parsed_by(edge_id));
  add_how(*command, options->how);
  command->footer(std::string("Examples:\n  relmap edge ") + verb.name + " 3:120/1 --dry-run\n  relmap edge " +
                  verb.name + " 3:120/1 --note 'I was there'");
  command->callback([&action, options, &verb] {
    action = [options, &verb](client::Client& client, terminal::Console& console) -> Status {
      const auto id = edge_id(options->id);
      if (!id.ok()) return id.status();
      const auto edit = client.edit_edge(*id, verb.action, options->how);
      if (!edit.ok()) return edit.status();
      if (!console.json) print(*edit, undo_of(verb, *edit), console);
      return {};
    };
  });
}

void add_propose(CLI::App& edge, Action& action) {
  auto* command =
      edge.add_subcommand("propose", "try to match two frames by geometry, and enter the closure that is found");
  auto options = std::make_shared<EditOptions>();
  command->add_option("A", options->a, "frame, session:index")->required()->check(parsed_by(parse_frame));
  command->add_option("B", options->b, "another frame, at the same place")->required()->check(parsed_by(parse_frame));
  command->add_flag("--accept", options->accept, "put the closure into force at once");
  add_how(*command, options->how);
  command->footer(
      "The closure is judged like any other: it stays a candidate until another one agrees, unless --accept is given.\n"
      "--note is kept with an --accept only.\n"
      "Examples:\n"
      "  relmap edge propose 2:17 5:77 --dry-run\n"
      "  relmap edge propose 2:17 5:77 --accept --note 'I was there'");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) -> Status {
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
  auto* command = app.add_subcommand("edge", "edit loop closures: remove, restore, accept, withdraw, propose");
  command->require_subcommand(1);
  add_remove(*command, action);
  for (const Verb& verb : kVerbs) add_verb(*command, verb, action);
  add_propose(*command, action);
  command->footer(
      "Each edit prints what it changed, and the command that undoes it.\n"
      "Examples:\n"
      "  relmap edge remove 3:120/1 --dry-run\n"
      "  relmap edge remove 3:120/1 --note 'that is the other hall'\n"
      "  relmap edge remove 3:120/1 --only-this   # those that agree with it stay\n"
      "  relmap edge restore 3:120/1\n"
      "  relmap edge accept 5:77/2 --note 'I was there'\n"
      "  relmap edge propose 2:17 5:77 --accept");
}

}  // namespace relmap::cli
