// relmap edges: edges and loop closures are listed, explained, and shown.
#include <algorithm>
#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "client/pair_picture.h"
#include "proto/base/clock.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/explain.h"
#include "tools/relmap/pairs.h"
#include "tools/relmap/picture_output.h"
#include "tools/relmap/time_option.h"
#include "tools/relmap/typed_text.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kSheetRows = 10, kMaxSheetRows = 50;

struct EdgesOptions {
  std::vector<std::string> states;
  std::string sessions, frame, near, since, until, by = "id", explain, out;
  double within = 0, min_suspicion = 0;
  std::uint32_t limit = 0;
  bool loops = false, suspicion = false;
};

void print(const std::vector<client::Edge>& edges, terminal::Console& console) {
  const bool judged =
      std::any_of(edges.begin(), edges.end(), [](const client::Edge& edge) { return edge.suspicion.has_value(); });
  std::vector<std::string> heads{"id",      "from",    "to",       "kind",     "state",  "because",
                                 "carries", ">metres", ">support", ">inliers", ">bound", ">prob."};
  if (judged) heads.insert(heads.end(), {">suspicion", "heaviest doubt"});
  std::vector<std::vector<std::string>> rows;
  for (const client::Edge& e : edges) {
    const bool loop = e.kind == client::EdgeKind::kLoop;
    rows.push_back({e.id.to_string(), e.a.to_string(), e.b.to_string(), name_of(e.kind), name_of(e.state),
                    std::string(reason_name(e.reason)), e.carries ? "edge" : "binds", fixed(e.T_ab.t.norm(), 2),
                    std::to_string(e.support) + (e.prior_active ? " +prior" : ""),
                    was_verified(e) ? std::to_string(e.inliers)
                    : loop          ? name_of(e.verification)
                                    : "",
                    loop ? std::to_string(e.bound) : "", was_verified(e) ? fixed(e.probability, 3) : ""});
    if (!judged) continue;
    rows.back().push_back(e.suspicion ? fixed(e.suspicion->value, 2) : "");
    const auto doubts = e.suspicion ? doubts_of(*e.suspicion) : std::vector<client::Doubt>();
    rows.back().push_back(doubts.empty() ? "" : name_of(doubts.front().kind));
  }
  console.table(heads, rows);
}

// Sets the session, or the two, that "morning" or "morning,evening" names; a name may have a comma itself.
Status choose_sessions(const std::string& text, client::Client& client, terminal::Console& console,
                       client::EdgeFilter& filter) {
  const std::size_t comma = text.find(',');
  const auto whole = find_session(client, console, text);
  if (whole.ok() || comma == std::string::npos || whole.reason() != Reason::NO_SUCH_SESSION) {
    if (whole.ok()) filter.session = *whole;
    return whole.status();
  }
  const auto one = find_session(client, console, text.substr(0, comma));
  if (!one.ok()) return one.status();
  const auto other = find_session(client, console, text.substr(comma + 1));
  if (!other.ok()) return other.status();
  filter.session = *one;
  filter.other_session = *other;
  return {};
}

Result<client::EdgeFilter> make_filter(const EdgesOptions& options, client::Client& client,
                                       terminal::Console& console) {
  client::EdgeFilter filter;
  for (const std::string& state : options.states) filter.states.push_back(*client::parse_edge_state(state));
  if (options.loops || options.suspicion || options.by != "id" || options.min_suspicion > 0 || !options.out.empty())
    filter.kinds.push_back(client::EdgeKind::kLoop);
  if (!options.sessions.empty())
    if (Status status = choose_sessions(options.sessions, client, console, filter); !status.ok()) return status;
  if (!options.frame.empty()) {
    const auto frame = parse_frame(options.frame);
    if (!frame.ok()) return frame.status();
    filter.frame = *frame;
  }
  if (!options.near.empty()) {
    const auto frame = parse_frame(options.near);
    if (!frame.ok()) return frame.status();
    // Within metres, the edges between need not be few.
    filter.region = client::Region{*frame, options.within > 0 ? 100000u : 0u, options.within};
  }
  for (const auto& [text, time] :
       {std::pair(&options.since, &filter.from_us), std::pair(&options.until, &filter.until_us)}) {
    if (text->empty()) continue;
    const auto parsed = parse_time(*text, now_us());
    if (!parsed.ok()) return parsed.status();
    *time = *parsed;
  }
  filter.min_suspicion = options.min_suspicion;
  filter.order = options.suspicion || options.by == "suspicion" ? client::EdgeOrder::kSuspicion
                 : options.by == "time"                         ? client::EdgeOrder::kTime
                                                                : client::EdgeOrder::kId;
  filter.limit = options.limit;
  return filter;
}

// "3 loop closures, the most suspicious first"
std::string subtitle_of(const client::EdgeFilter& filter, std::size_t count) {
  std::string text = counted_text(count, "loop closure");
  for (const client::EdgeState state : filter.states)
    text += (state == filter.states.front() ? ", " : " or ") + std::string(name_of(state));
  if (filter.order == client::EdgeOrder::kSuspicion) text += ", the most suspicious first";
  if (filter.order == client::EdgeOrder::kTime) text += ", the newest first";
  return text;
}

Status write_sheet(const EdgesOptions& options, const client::EdgeFilter& filter,
                   const std::vector<client::Edge>& edges, client::Client& client, terminal::Console& console) {
  const auto format = client::picture_format(options.out);
  if (!format.ok()) return format.status();
  if (edges.empty()) return {Reason::EMPTY_MAP, "there is no such loop closure to draw"};
  const terminal::Console::Aside aside(console);
  const auto sessions = read_sessions(client, console);
  if (!sessions.ok()) return sessions.status();
  const std::size_t rows =
      std::min(edges.size(), options.limit > 0 ? std::min<std::size_t>(options.limit, kMaxSheetRows) : kSheetRows);
  client::PairSheet sheet{"Loop closures", subtitle_of(filter, edges.size()), {}};
  if (rows < edges.size()) {
    sheet.subtitle += "; the first " + std::to_string(rows);
    console.err() << options.out << " shows the first " << rows << " of " << counted_text(edges.size(), "loop closure")
                  << " (--limit N: up to " << kMaxSheetRows << ")\n";
  }
  for (const client::Edge& edge : std::span(edges).first(rows)) {
    const auto explained = client.explain_edge(edge.id, /*with_pictures=*/true);
    if (!explained.ok()) return explained.status();
    sheet.pairs.push_back(pair_of(*explained, *sessions, client));
    sheet.pairs.back().title = std::to_string(sheet.pairs.size()) + ". " + sheet.pairs.back().title;
  }
  const auto bytes = client::draw_pair_sheet(sheet, *format);
  return bytes.ok() ? write_output(options.out, *bytes, console) : bytes.status();
}

Status list_edges(const EdgesOptions& options, client::Client& client, terminal::Console& console) {
  const auto filter = make_filter(options, client, console);
  if (!filter.ok()) return filter.status();
  const auto edges = client.edges(*filter);
  if (!edges.ok()) return edges.status();
  // A daemon that does not know the order lists what it likes.
  if (filter->order == client::EdgeOrder::kSuspicion && !edges->empty() && !edges->front().suspicion)
    return {Reason::UNIMPLEMENTED, "this relmapd does not tell how suspicious closures are; it is an older one"};
  if (!options.out.empty())
    if (Status status = write_sheet(options, *filter, *edges, client, console); !status.ok()) return status;
  if (!console.json) print(*edges, console);
  return {};
}

}  // namespace

void add_edges(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("edges", "list edges, loop closures among them; explain and show closures");
  auto options = std::make_shared<EdgesOptions>();
  std::vector<CLI::Option*> lists;
  const auto list = [&](CLI::Option* option) {
    lists.push_back(option);
    return option;
  };
  list(command->add_option("--state", options->states, "only edges in these states"))
      ->check(CLI::IsMember({"candidate", "accepted", "quarantined", "removed"}))
      ->delimiter(',');
  list(command->add_flag("--loops", options->loops, "only loop closures"));
  list(command->add_option("--session", options->sessions,
                           "only edges with an end in this session; A,B: only those between these two"))
      ->type_name("SESSION");
  list(command->add_option("--frame", options->frame, "only edges with this frame as an end"))
      ->type_name("FRAME")
      ->check(parsed_by(parse_frame));
  auto* const near =
      list(command->add_option("--near", options->near, "only edges with an end near this frame: within 30 edges"))
          ->type_name("FRAME")
          ->check(parsed_by(parse_frame));
  list(command->add_option("--within", options->within, "with --near: within so many metres along edges instead"))
      ->check(CLI::PositiveNumber)
      ->needs(near);
  const auto is_time = parsed_by([](const std::string& text) { return parse_time(text, now_us()); });
  list(command->add_option("--since", options->since, "only edges whose newer end was taken at this time or later"))
      ->type_name("TIME")
      ->check(is_time);
  list(command->add_option("--until", options->until, "... and before this time"))->type_name("TIME")->check(is_time);
  auto* const suspicion =
      list(command->add_flag("--suspicion", options->suspicion, "loop closures, the most suspicious first"));
  list(
      command->add_option("--by", options->by,
                          "order: by id; loop closures by suspicion, the most suspicious first, or by time, the newest "
                          "first"))
      ->check(CLI::IsMember({"id", "suspicion", "time"}))
      ->excludes(suspicion)
      ->capture_default_str();
  list(command->add_option("--min-suspicion", options->min_suspicion, "only loop closures at least as suspicious"))
      ->check(CLI::Range(0.0, 1.0));
  list(command->add_option("--limit", options->limit, "list at most so many, the first in the order"))
      ->check(CLI::PositiveNumber);
  auto* const explain =
      command
          ->add_option("--explain", options->explain,
                       "show what speaks for and against one edge (session:index/ordinal), and its history")
          ->type_name("EDGE")
          ->check(parsed_by(edge_id));
  for (CLI::Option* const option : lists) explain->excludes(option);
  command
      ->add_option(
          "--out", options->out,
          "write the pictures of both ends, with what both show joined by lines: of the edge that is "
          "explained, or of the first loop closures that are listed (10; --limit N: up to 50); FILE.png or FILE.svg")
      ->type_name("FILE");
  command->footer(
      "A time is written 2026-11-30, 2026-11-30T08:15:00Z (UTC), or 90s, 15min, 2h, 3d for so long ago.\n"
      "Suspicion is how doubtful a closure is, 0 to 1, from what the map knows of it. It decides nothing: it orders\n"
      "closures for those who look at them. docs/operations.md tells how to judge one.\n"
      "Examples:\n"
      "  relmap edges --loops --state accepted\n"
      "  relmap edges --suspicion --state accepted --limit 20   # which of those in force should be looked at?\n"
      "  relmap edges --by suspicion --limit 10 --out sheet.png # ten pairs of pictures, one a row\n"
      "  relmap edges --session morning,evening --since 2d\n"
      "  relmap edges --frame 3:120\n"
      "  relmap edges --explain 1:340/1                  # why it is in force, or not\n"
      "  relmap edges --explain 1:340/1 --out pair.png   # with both pictures");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) {
      return options->explain.empty() ? list_edges(*options, client, console)
                                      : explain_edge(options->explain, options->out, client, console);
    };
  });
}

}  // namespace relmap::cli
