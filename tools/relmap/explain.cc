#include "tools/relmap/explain.h"

#include <cmath>
#include <map>
#include <ostream>
#include <vector>

#include "client/pair_picture.h"
#include "proto/base/visible_text.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/degrees.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/pairs.h"
#include "tools/relmap/picture_output.h"

namespace relmap::cli {

namespace {

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
  out << "record " << event.journal_sequence;
  if (event.time_us != 0) out << ", " << time_text(event.time_us);
  if (!event.author.empty()) out << ", by " << visible_text(event.author);
  out << ": " << name_of(event.state) << ", " << reason_name(event.reason) << " (" << explanation(event.reason) << ')';
  if (event.cause != edge.id) out << ", by " << event.cause.to_string();
  if (!event.note.empty()) out << ": " << visible_text(event.note);
  out << '\n';
}

// What holds for every edge.
void print_edge(const client::Edge& edge, std::ostream& out) {
  out << edge.id.to_string() << ": " << name_of(edge.kind) << ' ' << edge.a.to_string() << " -> " << edge.b.to_string()
      << ", " << name_of(edge.state) << ", " << reason_name(edge.reason) << " (" << explanation(edge.reason) << ")\n";
  const auto sigma = [&](int row) { return std::sqrt(edge.covariance.diagonal().segment<3>(row).sum()); };
  out << "  measured  " << fixed(edge.T_ab.t.norm(), 2) << " m, " << fixed(kDegrees * rotation_angle(edge.T_ab.R), 1)
      << " degrees; sigma " << fixed(sigma(0), 3) << " m, " << fixed(kDegrees * sigma(3), 2) << " degrees\n";
  if (edge.state == client::EdgeState::kAccepted && edge.carries)
    out << "  carries   it is an edge of the graph, " << edge.support << " observations use it"
        << (edge.prior_active ? ", too few: the prior of its measurement holds it" : "") << '\n';
  else
    out << "  carries   nothing: it "
        << (edge.state == client::EdgeState::kAccepted ? "binds landmarks only" : "is not in force") << '\n';
  if (edge.carried)
    out << "  says      that the robot was carried: " << stretch_text(edge.carried->first, edge.carried->last) << '\n';
  if (!edge.carried_by.empty())
    out << "  carried   the robot was carried along it, according to" << ids_text(edge.carried_by, kMaxListed) << '\n';
}

void print_evidence(const client::Edge& edge, const SessionsByNumber& sessions, std::ostream& out) {
  out << "  evidence  " << verification_text(edge, session_words(sessions, edge.id.frame.session));
  if (was_verified(edge)) out << "; place with probability " << fixed(edge.probability, 3);
  out << "; binds " << edge.bound << '\n';
  if (edge.uniqueness) out << "  unique    " << uniqueness_text(*edge.uniqueness) << '\n';
}

void print_suspicion(const client::Edge& edge, std::ostream& out) {
  if (!edge.suspicion) return;
  const std::vector<client::Doubt> doubts = doubts_of(*edge.suspicion);
  out << "  suspicion " << fixed(edge.suspicion->value, 2) << " of 1"
      << (doubts.empty() ? ": nothing speaks against it" : "") << '\n';
  for (const client::Doubt& doubt : doubts) out << "    " << doubt_text(doubt) << '\n';
  if (!edge.suspicion->remark.empty()) out << "    " << visible_text(edge.suspicion->remark) << '\n';
}

void print_points(const client::EdgeExplanation& explained, std::ostream& out) {
  std::size_t inliers = 0;
  for (const client::Correspondence& match : explained.correspondences) inliers += match.inlier ? 1 : 0;
  out << "  today     ";
  if (explained.correspondences.empty())
    out << no_points_text(explained.correspondences_missing) << '\n';
  else
    out << "geometry finds " << inliers << " inliers among " << explained.correspondences.size() << " matches"
        << (explained.correspondences_missing.ok() ? "" : ": " + explained.correspondences_missing.to_string()) << '\n';
}

void print_others(const char* title, const std::map<std::string, std::vector<EdgeId>>& by_state, std::ostream& out) {
  std::size_t count = 0;
  for (const auto& [state, ids] : by_state) count += ids.size();
  out << title << counted_text(count, "closure") << " of other frames\n";
  for (const auto& [state, ids] : by_state)
    out << "    " << state << ' ' << ids.size() << ':' << ids_text(ids, kMaxListed) << '\n';
}

void print_agreements(const client::EdgeExplanation& explained, std::ostream& out) {
  std::map<std::string, std::vector<EdgeId>> agreeing, contradicting;
  for (const client::Agreement& other : explained.agreements)
    (other.agrees ? agreeing : contradicting)[name_of(other.state)].push_back(other.edge);
  print_others("  agree     ", agreeing, out);
  if (!contradicting.empty()) print_others("  against   ", contradicting, out);
}

void print_history(const client::Edge& edge, std::ostream& out) {
  out << "  history\n";
  for (const client::EdgeEvent& event : edge.history) {
    out << "    ";
    print_event(edge, event, out);
  }
}

void print(const client::EdgeExplanation& explained, const SessionsByNumber& sessions, std::ostream& out) {
  print_edge(explained.edge, out);
  print_evidence(explained.edge, sessions, out);
  print_suspicion(explained.edge, out);
  print_points(explained, out);
  out << "  motion    " << verdict_text(explained.motion) << '\n';
  print_agreements(explained, out);
  print_history(explained.edge, out);
}

// Of a daemon that does not explain closures: what the list of edges says.
void print_listed(const client::Edge& edge, const SessionsByNumber& sessions, client::Client& client,
                  std::ostream& out) {
  print_edge(edge, out);
  if (edge.kind != client::EdgeKind::kLoop) return;
  print_evidence(edge, sessions, out);
  std::map<std::string, std::vector<EdgeId>> agreeing;  // by state
  for (const EdgeId other : edge.consistent_with) {
    const auto found = find_edge(client, other);
    agreeing[found.ok() ? name_of(found->state) : found.status().to_string()].push_back(other);
  }
  print_others("  agree     ", agreeing, out);
  print_history(edge, out);
}

Status write_pair(EdgeId id, const std::string& out, client::Client& client, terminal::Console& console) {
  const auto format = client::picture_format(out);
  if (!format.ok()) return format.status();
  const terminal::Console::Aside aside(console);
  const auto explained = client.explain_edge(id, /*with_pictures=*/true);
  if (!explained.ok()) return explained.status();
  const auto sessions = read_sessions(client, console);
  if (!sessions.ok()) return sessions.status();
  const auto bytes = client::draw_pair(pair_of(*explained, *sessions, client), *format);
  return bytes.ok() ? write_output(out, *bytes, console) : bytes.status();
}

}  // namespace

Status explain_edge(const std::string& text, const std::string& out, client::Client& client,
                    terminal::Console& console) {
  const auto id = edge_id(text);
  if (!id.ok()) return id.status();
  if (!out.empty())
    if (Status status = write_pair(*id, out, client, console); !status.ok()) return status;
  const auto explained = client.explain_edge(*id);
  // Of the robot's own motion there is less to tell, and of closures if the daemon is an older one.
  if (!explained.ok() && explained.reason() != Reason::ODOMETRY_EDGE && explained.reason() != Reason::UNIMPLEMENTED)
    return explained.status();
  const auto edge = explained.ok() ? Result<client::Edge>(explained->edge) : find_edge(client, *id);
  if (!edge.ok()) return edge.status();
  if (console.json) return {};
  const auto sessions = read_sessions(client, console);
  if (!sessions.ok()) return sessions.status();
  if (explained.ok())
    print(*explained, *sessions, console.out());
  else
    print_listed(*edge, *sessions, client, console.out());
  return {};
}

}  // namespace relmap::cli
