#include "server/map/operator_proposal.h"

#include <algorithm>
#include <utility>

#include "server/map/edge_edit.h"
#include "server/map/propose.h"
#include "server/place/map_points.h"
#include "server/place/verify.h"

namespace relmap::map {

Result<std::uint64_t> write_proposal(Mapper& mapper, storage::ClosureProposalRecord found,
                                     const OperatorProposal& proposal, std::chrono::steady_clock::time_point deadline) {
  const FrameId query = found.query, match = found.match;
  if (!proposal.accept) found.edit = proposal.edit;
  found.submitted.author = proposal.author;
  const auto written = mapper.submit_and_wait(std::move(found));
  if (!written.ok()) return written.status();
  if (Status applied = mapper.wait_applied(*written, deadline); !applied.ok()) return applied;
  const auto view = mapper.view();
  const auto edge = closure_between(*view, query, match);
  if (!edge || edge->history.front().journal_sequence != *written) return overtaken();
  if (!proposal.accept) return *written;
  storage::SetEdgeStateRecord accept = edit_record(edge->id, EdgeAction::kAccept, proposal.note);
  if (Status possible = check_edge_edit(*view, accept); !possible.ok())
    return {possible.reason(), "proposed as " + edge->id.to_string() + ", but: " + possible.message()};
  accept.edit = proposal.edit;
  accept.submitted.author = proposal.author;
  return mapper.submit_and_wait(std::move(accept));
}

std::optional<storage::Edge> closure_of_record(const storage::Graph& graph, FrameId a, FrameId b,
                                               std::uint64_t sequence) {
  const auto is_it = [&](const storage::Edge& edge) {
    return std::any_of(edge.history.begin(), edge.history.end(), [&](const storage::EdgeEvent& event) {
      return event.journal_sequence == sequence && (event.cause == edge.id || event == edge.history.front());
    });
  };
  for (const FrameId end : {a, b})
    for (const place::PlacedFrame& near : place::along_odometry(graph, end, place::kViewReach, place::kViewReach)) {
      const auto hot = graph.hot(near.frame);
      for (const storage::Edge& edge : hot->edges)
        if (is_it(edge)) return edge;
    }
  return std::nullopt;
}

std::optional<std::vector<EdgeChange>> changes_of_proposal(const Mapper& mapper, const storage::Edge& closure,
                                                           std::uint64_t sequence) {
  const std::uint64_t first = closure.history.front().journal_sequence;
  auto changes = mapper.edge_changes(first);
  if (!changes || first == sequence) return changes;
  return combined(*std::move(changes), mapper.edge_changes(sequence).value_or(std::vector<EdgeChange>()));
}

Result<std::optional<std::vector<EdgeChange>>> changes_of_edit(const Mapper& mapper, std::uint64_t sequence) {
  auto changes = mapper.edge_changes(sequence);
  if (changes && changes->empty()) return overtaken();
  return changes;
}

}  // namespace relmap::map
