// An operator's edits of loop closures: SetEdgeState and ProposeEdge.
#include "proto/wire/convert.h"
#include "server/map/dry_run.h"
#include "server/map/edge_edit.h"
#include "server/map/operator_proposal.h"
#include "server/map/propose.h"
#include "server/rpc/charge.h"
#include "server/rpc/core.h"
#include "server/rpc/edit_log.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/request_context.h"

namespace relmap::rpc {

namespace {

void add_effect(EdgeId edited, const std::vector<map::EdgeChange>& changes, v1::SetEdgeStateReply& reply) {
  *reply.mutable_effect() = effect_message(changes);
  for (const EdgeId other : map::also_changed(changes, edited)) *reply.add_also_changed() = to_wire(other);
}

Result<storage::ClosureProposalRecord> find_closure(const storage::Graph& view, map::Mapper& mapper, PictureTurn& turn,
                                                    FrameId a, FrameId b) {
  const MutexLock lock(turn.mutex);
  place::PictureCache pictures;
  return map::propose_closure(view, mapper.places(), pictures, a, b);
}

Result<v1::ProposeEdgeReply> propose_dry(map::Mapper& mapper, const RpcLimits& limits, PictureTurn& turn, FrameId a,
                                         FrameId b, const v1::ProposeEdgeRequest& request, const Deadline& deadline) {
  const auto view = mapper.view();
  const auto proposal = find_closure(*view, mapper, turn, a, b);
  if (!proposal.ok()) return proposal.status();
  SearchWork work(mapper.budget(), limits.max_search_frames, deadline);
  map::DryRun run(*view, view->state(), work.limit().proceed);
  const EdgeId id = run.propose(*proposal);
  if (request.accept())
    if (Status status = run.edit(map::edit_record(id, map::EdgeAction::kAccept, request.note())); !status.ok())
      return status;
  v1::ProposeEdgeReply reply;
  *reply.mutable_edge() = edge_message(*view, run.edge(id));
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
  if (Status valid = map::check_edge_record(record); !valid.ok()) return valid;

  v1::SetEdgeStateReply reply;
  if (request.dry_run()) {
    const auto view = mapper.view();
    SearchWork work(mapper.budget(), limits.max_search_frames, deadline);
    map::DryRun run(*view, view->state(), work.limit().proceed);
    reply.set_shown(run.removal(record));
    if (Status status = run.edit(record); !status.ok()) return status;
    *reply.mutable_edge() = edge_message(*view, run.edge(*id));
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
  const auto changes = map::changes_of_edit(mapper, sequence);
  if (!changes.ok()) return changes.status();
  if (*changes) add_effect(*id, **changes, reply);
  *reply.mutable_edge() = edge_message(*view, *edge);
  reply.set_journal_sequence(sequence);
  reply.set_map_version(view->version());
  return reply;
}

Result<v1::ProposeEdgeReply> propose_edge(const v1::ProposeEdgeRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, EditLog& edits, const RpcLimits& limits,
                                          PictureTurn& turn) {
  const auto a = existing_frame(*mapper.view(), request.has_a(), request.a(), "a");
  if (!a.ok()) return a.status();
  const auto b = existing_frame(*mapper.view(), request.has_b(), request.b(), "b");
  if (!b.ok()) return b.status();
  if (Status status = check_note(request.note()); !status.ok()) return status;
  if (request.dry_run()) return propose_dry(mapper, limits, turn, *a, *b, request, deadline);

  const auto written =
      edits.once(request.idempotency_key(), request.SerializeAsString(), deadline,
                 [&](const storage::EditKey& named) -> Result<std::uint64_t> {
                   auto found = find_closure(*mapper.view(), mapper, turn, *a, *b);
                   if (!found.ok()) return found.status();
                   return map::write_proposal(mapper, *std::move(found),
                                              {request.accept(), request.note(), named, current_author()}, deadline.at);
                 });
  if (!written.ok()) return written.status();
  if (Status applied = mapper.wait_applied(*written, deadline.at); !applied.ok()) return applied;
  const auto view = mapper.view();
  const auto edge = map::closure_of_record(*view, *a, *b, *written);
  if (!edge) return map::overtaken();
  v1::ProposeEdgeReply reply;
  *reply.mutable_edge() = edge_message(*view, *edge);
  if (const auto changes = map::changes_of_proposal(mapper, *edge, *written))
    *reply.mutable_effect() = effect_message(*changes);
  reply.set_journal_sequence(*written);
  reply.set_map_version(view->version());
  return reply;
}

}  // namespace relmap::rpc
