// Labels and loop closures: looked at and changed.
#include <memory>
#include <ostream>

#include "tools/relmap/commands.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

void print(const std::vector<client::Edge>& edges, Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::Edge& e : edges) {
    const bool loop = e.kind == client::EdgeKind::kLoop;
    rows.push_back({e.id.to_string(), e.a.to_string(), e.b.to_string(), name_of(e.kind), name_of(e.state),
                    std::string(reason_name(e.reason)), e.carries ? "edge" : "binds", fixed(e.T_ab.t.norm(), 2),
                    std::to_string(e.support) + (e.prior_active ? " +prior" : ""),
                    loop ? std::to_string(e.inliers) : "", loop ? std::to_string(e.bound) : "",
                    loop ? fixed(e.probability, 3) : ""});
  }
  console.table({"id", "from", "to", "kind", "state", "because", "carries", ">metres", ">support", ">inliers", ">bound",
                 ">prob."},
                rows);
}

struct LabelOptions {
  std::string frame, name;
  bool remove = false;
};

Status label(const LabelOptions& options, client::Client& client, Console& console) {
  const auto frame = parse_frame(options.frame);
  if (!frame.ok()) return frame.status();
  const auto labels = client.set_label(*frame, options.name, !options.remove);
  if (!labels.ok()) return labels.status();
  if (console.json) return {};
  console.out() << frame->to_string() << ':';
  for (const std::string& text : *labels) console.out() << ' ' << text;
  console.out() << '\n';
  return {};
}

struct EdgesOptions {
  std::vector<std::string> states;
  std::string session, frame;
  bool loops = false;
};

Status list_edges(const EdgesOptions& options, client::Client& client, Console& console) {
  client::EdgeFilter filter;
  for (const std::string& state : options.states) filter.states.push_back(*client::parse_edge_state(state));
  if (options.loops) filter.kinds.push_back(client::EdgeKind::kLoop);
  if (!options.session.empty()) {
    const auto session = find_session(client, console, options.session);
    if (!session.ok()) return session.status();
    filter.session = *session;
  }
  if (!options.frame.empty()) {
    const auto frame = parse_frame(options.frame);
    if (!frame.ok()) return frame.status();
    filter.frame = *frame;
  }
  const auto edges = client.edges(filter);
  if (!edges.ok()) return edges.status();
  if (!console.json) print(*edges, console);
  return {};
}

struct EdgeOptions {
  std::string id, note;
};

Status set_state(const EdgeOptions& options, client::EdgeState state, client::Client& client, Console& console) {
  const auto id = EdgeId::parse(options.id);
  if (!id)
    return {Reason::INVALID_ARGUMENT,
            "'" + options.id + "' is no edge; one is written session:index/ordinal, as 3:120/1"};
  const auto change = client.set_edge_state(*id, state, options.note);
  if (!change.ok()) return change.status();
  if (console.json) return {};
  console.out() << id->to_string() << ": " << name_of(change->edge.state) << '\n';
  for (const EdgeId& other : change->also_changed) console.out() << other.to_string() << ": changed with it\n";
  return {};
}

}  // namespace

void add_label(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("label", "gives a frame a name, or takes it off");
  auto options = std::make_shared<LabelOptions>();
  command->add_option("FRAME", options->frame, "session:index")->required();
  command->add_option("NAME", options->name, "1..64 bytes")->required();
  command->add_flag("--remove", options->remove, "take it off");
  command->callback([&action, options] {
    action = [options](client::Client& client, Console& console) { return label(*options, client, console); };
  });
}

void add_labels(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("labels", "the names in the map, and their frames");
  auto prefix = std::make_shared<std::string>();
  command->add_option("PREFIX", *prefix, "only those that begin with it");
  command->callback([&action, prefix] {
    action = [prefix](client::Client& client, Console& console) -> Status {
      const auto labels = client.labels(*prefix);
      if (!labels.ok()) return labels.status();
      std::vector<std::vector<std::string>> rows;
      for (const client::LabelledFrames& found : *labels)
        for (const FrameId frame : found.frames) rows.push_back({found.label, frame.to_string()});
      if (!console.json) console.table({"label", "frame"}, rows);
      return {};
    };
  });
}

void add_edges(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("edges", "edges of the map, loop closures among them");
  auto options = std::make_shared<EdgesOptions>();
  command->add_option("--state", options->states, "only these states")
      ->check(CLI::IsMember({"candidate", "accepted", "quarantined", "removed"}))
      ->delimiter(',');
  command->add_flag("--loops", options->loops, "only loop closures");
  command->add_option("--session", options->session, "with an end in this session");
  command->add_option("--frame", options->frame, "with this frame as an end");
  command->callback([&action, options] {
    action = [options](client::Client& client, Console& console) { return list_edges(*options, client, console); };
  });
}

void add_edge(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("edge", "takes a loop closure out of the map, or back in");
  command->require_subcommand(1);
  const auto add = [&](const char* name, const char* help, client::EdgeState state) {
    auto* change = command->add_subcommand(name, help);
    auto options = std::make_shared<EdgeOptions>();
    change->add_option("ID", options->id, "session:index/ordinal")->required();
    change->add_option("--note", options->note, "why, for the journal");
    change->callback([&action, options, state] {
      action = [options, state](client::Client& client, Console& console) {
        return set_state(*options, state, client, console);
      };
    });
  };
  add("remove", "take it out, with all that it bound", client::EdgeState::kRemoved);
  add("accept", "take it in", client::EdgeState::kAccepted);
}

}  // namespace relmap::cli
