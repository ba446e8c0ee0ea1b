// An operator's edits of loop closures: SetEdgeState and ProposeEdge.
#include <algorithm>

#include "proto/wire/convert.h"
#include "server/map/edge_edit.h"
#include "server/map/propose.h"
#include "server/place/map_points.h"
#include "server/place/verify.h"
#include "server/rpc/edge_effect.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/search_work.h"
#include "server/rpc/write_and_wait.h"
#include "storage/map/draft.h"

namespace relmap::rpc {

namespace {

// Applies edits to a draft that nobody else sees, to find what they would change.
class DryRun {
 public:
  DryRun(storage::Budget& budget, const RpcLimits& limits, const storage::MapView& view, const Deadline& deadline)
      : work_(budget, limits.max_search_frames, deadline),
        draft_(view, view.state(), work_.limit().proceed),
        recorder_(draft_),
        sequence_(view.state().applied_sequence) {}

  Status edit(const storage::SetEdgeStateRecord& record) {
    if (Status possible = map::check_edge_edit(recorder_, record); !possible.ok()) return possible;
    map::apply_edge_edit(recorder_, ++sequence_, record);
    return {};
  }
  EdgeId propose(const storage::ClosureProposalRecord& record) {
    map::apply_proposal(recorder_, ++sequence_, record);
    return map::closure_between(recorder_, record.query, record.match)->id;
  }

  // Must be called before the edit.
  std::uint64_t removal(EdgeId id) const {
    return storage::find_edge(recorder_, id) ? map::removal_mark(recorder_, id) : 0;
  }

  v1::Edge edge(EdgeId id) const { return edge_message(*storage::find_edge(recorder_, id)); }
  std::vector<map::EdgeChange> changes() const { return recorder_.changes(); }

 private:
  SearchWork work_;
  storage::Draft draft_;
  map::EdgeRecorder recorder_;
  std::uint64_t sequence_;
};

void add_effect(EdgeId edited, const std::vector<map::EdgeChange>& changes, v1::SetEdgeStateReply& reply) {
  *reply.mutable_effect() = effect_message(changes);
  for (const map::EdgeChange& change : changes)
    if (change.kind == storage::EdgeKind::kLoop && change.id != edited && change.before && change.after &&
        change.before->state != change.after->state)
      *reply.add_also_changed() = to_wire(change.id);
}

// The refusal of an edit because the map changed between its check and its turn in the journal.
Status overtaken() {
  return {Reason::WRONG_STATE, "the map has changed meanwhile, and the edit changed nothing: ask again"};
}

// The closure between these two frames, or frames beside them, that the record with this sequence proposed or accepted.
std::optional<storage::Edge> edited_near(const storage::Graph& graph, FrameId a, FrameId b, std::uint64_t sequence) {
  const auto is_it = [&](const storage::Edge& edge) {
    return std::any_of(edge.history.begin(), edge.history.end(), [&](const storage::EdgeEvent& event) {
      return event.journal_sequence == sequence && (event.cause == edge.id || event == edge.history.front());
    });
  };
  for (const FrameId end : {a, b})
    for (const place::PlacedFrame& near : place::along_odometry(graph, end, place::kViewReach, place::kViewReach))
      for (const storage::Edge& edge : graph.hot(near.frame)->edges)
        if (is_it(edge)) return edge;
  return std::nullopt;
}

Status write_proposal(map::Mapper& mapper, EditLog& edits, FrameId a, FrameId b, const v1::ProposeEdgeRequest& request,
                      const Deadline& deadline, std::uint64_t& sequence) {
  place::PictureCache pictures;
  const auto proposed =
      edits.once(request.idempotency_key(), request.SerializeAsString(), deadline, [&]() -> Result<std::uint64_t> {
        auto proposal = map::propose_closure(*mapper.view(), mapper.places(), pictures, a, b);
        if (!proposal.ok()) return proposal.status();
        const FrameId query = proposal->query, match = proposal->match;
        const auto written = mapper.submit_and_wait(std::move(proposal).value());
        if (!written.ok()) return written.status();
        if (Status applied = mapper.wait_applied(*written, deadline.at); !applied.ok()) return applied;
        const auto view = mapper.view();
        const auto edge = map::closure_between(*view, query, match);
        if (!edge || edge->history.front().journal_sequence != *written) return overtaken();
        if (!request.accept()) return *written;
        const storage::SetEdgeStateRecord accept = map::edit_record(edge->id, map::EdgeAction::kAccept, request.note());
        if (Status possible = map::check_edge_edit(*view, accept); !possible.ok())
          return {possible.reason(), "proposed as " + edge->id.to_string() + ", but: " + possible.message()};
        return mapper.submit_and_wait(accept);
      });
  if (!proposed.ok()) return proposed.status();
  sequence = *proposed;
  return mapper.wait_applied(sequence, deadline.at);
}

Result<v1::ProposeEdgeReply> propose_dry(map::Mapper& mapper, const RpcLimits& limits, FrameId a, FrameId b,
                                         const v1::ProposeEdgeRequest& request, const Deadline& deadline) {
  const auto view = mapper.view();
  place::PictureCache pictures;
  const auto proposal = map::propose_closure(*view, mapper.places(), pictures, a, b);
  if (!proposal.ok()) return proposal.status();
  DryRun run(mapper.budget(), limits, *view, deadline);
  const EdgeId id = run.propose(*proposal);
  if (request.accept())
    if (Status status = run.edit(map::edit_record(id, map::EdgeAction::kAccept, request.note())); !status.ok())
      return status;
  v1::ProposeEdgeReply reply;
  *reply.mutable_edge() = run.edge(id);
  *reply.mutable_effect() = effect_message(run.changes());
  reply.set_map_version(view->version());
  return reply;
}

}  // namespace

Result<v1::SetEdgeStateReply> set_edge_state(const v1::SetEdgeStateRequest& request, const Deadline& deadline,
                                             map::Mapper& mapper, EditLog& edits, const RpcLimits& limits) {
  if (!request.has_edge()) return {Reason::INVALID_ARGUMENT, "edge is missing"};
  const auto id = from_wire(request.edge());
  if (!id.ok()) return id.status();
  const auto state = from_wire(request.state());
  if (!state.ok()) return state.status();
  if (Status status = check_note(request.note()); !status.ok()) return status;
  storage::SetEdgeStateRecord record{*id, *state, request.note()};
  record.decided = request.decided();
  record.alone = request.alone();
  record.shown = request.shown();
  const bool removes_all = *state == storage::EdgeState::kRemoved && !record.alone;
  if (record.shown != 0 && !removes_all)
    return {Reason::INVALID_ARGUMENT, "shown is only allowed in the removal of a closure and all that agree with it"};

  v1::SetEdgeStateReply reply;
  if (request.dry_run()) {
    const auto view = mapper.view();
    DryRun run(mapper.budget(), limits, *view, deadline);
    if (removes_all) reply.set_shown(run.removal(*id));
    if (Status status = run.edit(record); !status.ok()) return status;
    *reply.mutable_edge() = run.edge(*id);
    add_effect(*id, run.changes(), reply);
    reply.set_map_version(view->version());
    return reply;
  }
  std::uint64_t sequence = 0;
  const Status status = write_and_wait(
      mapper, edits, request.idempotency_key(), request.SerializeAsString(), deadline,
      [&]() -> Result<storage::JournalRecord> {
        if (Status possible = map::check_edge_edit(*mapper.view(), record); !possible.ok()) return possible;
        return storage::JournalRecord(record);
      },
      sequence);
  if (!status.ok()) return status;

  const auto view = mapper.view();
  const auto edge = storage::find_edge(*view, *id);
  if (!edge) return {Reason::NO_SUCH_EDGE, "no edge " + id->to_string()};
  if (const auto changes = mapper.edge_changes(sequence)) {
    if (changes->empty()) return overtaken();
    add_effect(*id, *changes, reply);
  }
  *reply.mutable_edge() = edge_message(*edge);
  reply.set_journal_sequence(sequence);
  reply.set_map_version(view->version());
  return reply;
}

Result<v1::ProposeEdgeReply> propose_edge(const v1::ProposeEdgeRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, EditLog& edits, const RpcLimits& limits) {
  const auto a = existing_frame(*mapper.view(), request.has_a(), request.a(), "a");
  if (!a.ok()) return a.status();
  const auto b = existing_frame(*mapper.view(), request.has_b(), request.b(), "b");
  if (!b.ok()) return b.status();
  if (Status status = check_note(request.note()); !status.ok()) return status;
  if (request.dry_run()) return propose_dry(mapper, limits, *a, *b, request, deadline);

  std::uint64_t sequence = 0;
  if (Status status = write_proposal(mapper, edits, *a, *b, request, deadline, sequence); !status.ok()) return status;
  const auto view = mapper.view();
  const auto edge = edited_near(*view, *a, *b, sequence);
  if (!edge) return overtaken();
  v1::ProposeEdgeReply reply;
  *reply.mutable_edge() = edge_message(*edge);
  const std::uint64_t first = edge->history.front().journal_sequence;
  if (auto changes = mapper.edge_changes(first)) {
    if (first != sequence)
      changes = combined(*std::move(changes), mapper.edge_changes(sequence).value_or(std::vector<map::EdgeChange>()));
    *reply.mutable_effect() = effect_message(*changes);
  }
  reply.set_journal_sequence(sequence);
  reply.set_map_version(view->version());
  return reply;
}

}  // namespace relmap::rpc
