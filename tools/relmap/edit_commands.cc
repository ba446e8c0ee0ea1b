// relmap label, labels and edges: labels are listed and edited, edges listed and explained.
#include <cmath>
#include <map>
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "tools/relmap/commands.h"
#include "tools/relmap/degrees.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

void print(const std::vector<client::Edge>& edges, terminal::Console& console) {
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
  std::string place, name;
  bool remove = false;
  ViewOptions camera;
};

struct Shown {
  FrameId frame;
  std::uint32_t inliers = 0;
  client::Verification verification = client::Verification::kNone;
};

// The frame that a picture shows, if geometry confirms it. No route leads to photographs (mono sessions), so one of
// them is returned only if no other frame shows the place, however well it fits.
Result<Shown> find_shown(const client::View& view, client::Client& client, terminal::Console& console) {
  const auto matches = client.match_image(view, {});
  if (!matches.ok()) return matches.status();
  const terminal::Console::Aside aside(console);
  const auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  std::set<SessionNumber> mono;
  for (const client::Session& session : *sessions)
    if (!session.camera.is_stereo()) mono.insert(session.number);
  const Status& nothing = matches->nothing_verified;
  if (nothing.ok())
    for (const client::PlaceMatch& place : matches->places)
      if (place.unverified.ok() && !mono.contains(place.frame.session))
        return Shown{place.frame, place.inliers, place.verification};
  if (mono.empty()) return nothing;
  // Photographs may have displaced other frames from the likeliest places, or made the best one ambiguous.
  if (const auto found = client.localise(view); found.ok())
    return Shown{found->frame, found->inliers, found->verification};
  if (!nothing.ok()) return nothing;
  const client::PlaceMatch& best = matches->places.front();
  console.err() << "only photographs show this place; no route leads to them: session " << best.frame.session << '\n';
  return Shown{best.frame, best.inliers, best.verification};
}

Result<FrameId> find_place(const LabelOptions& options, client::Client& client, terminal::Console& console) {
  if (const auto frame = FrameId::parse(options.place)) return *frame;
  const auto view = make_view(client, console, options.place, "", options.camera);
  if (!view.ok()) return view.status();
  const auto shown = find_shown(*view, client, console);
  if (!shown.ok()) return shown.status();
  console.err() << options.place << " shows " << shown->frame.to_string() << ": " << shown->inliers << " inliers ("
                << name_of(shown->verification) << ")\n";
  return shown->frame;
}

Status label(const LabelOptions& options, client::Client& client, terminal::Console& console) {
  const auto frame = find_place(options, client, console);
  if (!frame.ok()) return frame.status();
  const auto labels = client.set_label(*frame, options.name, !options.remove);
  if (!labels.ok()) return labels.status();
  if (console.json) return {};
  console.out() << frame->to_string() << ':';
  for (const std::string& text : *labels) console.out() << ' ' << text;
  console.out() << '\n';
  return {};
}

Result<client::Edge> find_edge(client::Client& client, EdgeId id) {
  client::EdgeFilter filter;
  filter.frame = id.frame;
  auto edges = client.edges(filter);
  if (!edges.ok()) return edges.status();
  for (client::Edge& edge : *edges)
    if (edge.id == id) return std::move(edge);
  return Status(Reason::NO_SUCH_EDGE, "no edge " + id.to_string());
}

void print_event(const client::Edge& edge, const client::EdgeEvent& event, std::ostream& out) {
  out << "record " << event.journal_sequence << ": " << name_of(event.state) << ", " << reason_name(event.reason)
      << " (" << explanation(event.reason) << ')';
  if (event.cause != edge.id) out << ", by " << event.cause.to_string();
  if (!event.note.empty()) out << ": " << event.note;
  out << '\n';
}

// Prints why an edge is in its state: its evidence, the closures that agree, and its history.
Status explain(const std::string& text, client::Client& client, terminal::Console& console) {
  const auto id = edge_id(text);
  if (!id.ok()) return id.status();
  const auto edge = find_edge(client, *id);
  if (!edge.ok()) return edge.status();
  if (console.json) return {};
  std::ostream& out = console.out();
  out << edge->id.to_string() << ": " << name_of(edge->kind) << ' ' << edge->a.to_string() << " -> "
      << edge->b.to_string() << ", " << name_of(edge->state) << ", " << reason_name(edge->reason) << " ("
      << explanation(edge->reason) << ")\n";
  const auto sigma = [&](int row) { return std::sqrt(edge->covariance.diagonal().segment<3>(row).sum()); };
  out << "  measured  " << fixed(edge->T_ab.t.norm(), 2) << " m, " << fixed(kDegrees * rotation_angle(edge->T_ab.R), 1)
      << " degrees; sigma " << fixed(sigma(0), 3) << " m, " << fixed(kDegrees * sigma(3), 2) << " degrees\n";
  if (edge->state == client::EdgeState::kAccepted && edge->carries)
    out << "  carries   it is an edge of the graph, " << edge->support << " observations use it"
        << (edge->prior_active ? ", too few: the prior of its measurement holds it" : "") << '\n';
  else
    out << "  carries   nothing: it "
        << (edge->state == client::EdgeState::kAccepted ? "binds landmarks only" : "is not in force") << '\n';
  if (edge->carried)
    out << "  says      that the robot was carried: " << stretch_text(edge->carried->first, edge->carried->last)
        << '\n';
  if (!edge->carried_by.empty())
    out << "  carried   the robot was carried along it, according to" << ids_text(edge->carried_by, kMaxListed) << '\n';
  if (edge->kind != client::EdgeKind::kLoop) return {};
  out << "  evidence  verified by " << name_of(edge->verification) << ": " << edge->inliers << " inliers over "
      << fixed(100 * edge->spread, 0) << " % of the picture; place with probability " << fixed(edge->probability, 3)
      << "; binds " << edge->bound << '\n';
  if (edge->uniqueness) out << "  unique    " << uniqueness_text(*edge->uniqueness) << '\n';
  std::map<std::string, std::vector<EdgeId>> agreeing;  // by state
  for (const EdgeId other : edge->consistent_with) {
    const auto found = find_edge(client, other);
    agreeing[found.ok() ? name_of(found->state) : found.status().to_string()].push_back(other);
  }
  out << "  agree     " << edge->consistent_with.size() << " closures of other frames\n";
  for (const auto& [state, ids] : agreeing)
    out << "    " << state << ' ' << ids.size() << ':' << ids_text(ids, kMaxListed) << '\n';
  out << "  history\n";
  for (const client::EdgeEvent& event : edge->history) {
    out << "    ";
    print_event(*edge, event, out);
  }
  return {};
}

struct EdgesOptions {
  std::vector<std::string> states;
  std::string session, frame, explain;
  bool loops = false;
};

Status list_edges(const EdgesOptions& options, client::Client& client, terminal::Console& console) {
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

}  // namespace

void add_label(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("label", "give a frame a label, or remove the label");
  auto options = std::make_shared<LabelOptions>();
  command
      ->add_option("PLACE", options->place,
                   "a frame (session:index), or a picture: the frame that it shows, if geometry confirms it")
      ->type_name("FRAME|PICTURE")
      ->required();
  command->add_option("NAME", options->name, "the label: 1 to 64 bytes, not only white space")->required();
  command->add_flag("--remove", options->remove, "remove the label");
  add_view_options(*command, options->camera);
  command->footer(
      "A picture labels the frame that it shows, one that routes lead to. If only photographs (a mono session) show "
      "the\n"
      "place, one of these is labelled, and a message says so.\n"
      "Examples:\n"
      "  relmap label 3:120 kitchen\n"
      "  relmap label photo.jpg 'Trafalgar Square'");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) { return label(*options, client, console); };
  });
}

void add_labels(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("labels", "list labels and their frames");
  struct Asked {
    std::string prefix, words;
  };
  auto asked = std::make_shared<Asked>();
  command->add_option("PREFIX", asked->prefix, "only labels that begin with this, in upper or lower case");
  command->add_option("--words", asked->words, "only labels with words that begin like these, as 'traf sq'");
  command->footer(
      "Upper and lower case (a to z) are not distinguished.\n"
      "Examples:\n"
      "  relmap labels\n"
      "  relmap labels traf             # \"Traffic light\", and \"Trafalgar Square\"\n"
      "  relmap labels --words 'sq traf'");
  command->callback([&action, asked] {
    action = [asked](client::Client& client, terminal::Console& console) -> Status {
      const auto labels = client.labels(asked->prefix, asked->words);
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
  auto* command = app.add_subcommand("edges", "list edges, loop closures among them");
  auto options = std::make_shared<EdgesOptions>();
  auto* const state = command->add_option("--state", options->states, "only edges in these states");
  state->check(CLI::IsMember({"candidate", "accepted", "quarantined", "removed"}))->delimiter(',');
  auto* const loops = command->add_flag("--loops", options->loops, "only loop closures");
  auto* const session = command->add_option("--session", options->session, "only edges with an end in this session")
                            ->type_name("SESSION");
  auto* const frame =
      command->add_option("--frame", options->frame, "only edges with this frame as an end")->type_name("FRAME");
  command
      ->add_option("--explain", options->explain, "show the evidence and history of one edge (session:index/ordinal)")
      ->type_name("EDGE")
      ->excludes(state, loops, session, frame);
  command->footer(
      "Examples:\n"
      "  relmap edges --loops --state accepted\n"
      "  relmap edges --frame 3:120\n"
      "  relmap edges --explain 1:340/1   # why it is in force, or not");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) {
      return options->explain.empty() ? list_edges(*options, client, console)
                                      : explain(options->explain, client, console);
    };
  });
}

}  // namespace relmap::cli
