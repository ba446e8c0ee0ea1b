// Puts a closure between two frames that an operator names into the running map, and finds it there again. Tells what
// that, or an edit of a closure, has changed.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/map/mapper.h"

namespace relmap::map {

// What happens to a closure that an operator proposes.
struct OperatorProposal {
  bool accept = false;  // the closure is put into force at once
  std::string note;     // of the acceptance
  storage::EditKey edit = {};
  std::string author = {};  // the operator's name
};

// Journals the closure that propose_closure() has found and, if it is to be put into force, that edit once the closure
// is in the map. Returns the sequence of the last record, which is durable but perhaps not applied yet. The reasons are
// those of Mapper::submit_and_wait(), Mapper::wait_applied() and check_edge_edit(), whose message then names the
// closure that was stored, or overtaken().
Result<std::uint64_t> write_proposal(Mapper& mapper, storage::ClosureProposalRecord found,
                                     const OperatorProposal& proposal, std::chrono::steady_clock::time_point deadline);

// The closure between these two frames, or frames beside them, that the record with this sequence proposed or put into
// force; nullopt if that record stored none.
std::optional<storage::Edge> closure_of_record(const storage::Graph& graph, FrameId a, FrameId b,
                                               std::uint64_t sequence);

// The changes of edges by the records of a proposal: that which stored `closure`, and the last one, `sequence`, if that
// is another. nullopt if the mapper does not remember them any more.
std::optional<std::vector<EdgeChange>> changes_of_proposal(const Mapper& mapper, const storage::Edge& closure,
                                                           std::uint64_t sequence);

// The changes of edges by the edit of a closure with this sequence, which must be applied; nullopt if the mapper does
// not remember them any more. overtaken() if it changed nothing.
Result<std::optional<std::vector<EdgeChange>>> changes_of_edit(const Mapper& mapper, std::uint64_t sequence);

}  // namespace relmap::map
