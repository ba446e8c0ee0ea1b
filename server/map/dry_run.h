// A dry run of an operator's edits: it reports what they would change, and changes nothing.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "server/map/edge_changes.h"
#include "server/map/edge_edit.h"
#include "storage/journal/journal_record.h"
#include "storage/map/draft.h"

namespace relmap::map {

// Applies edits to a draft that nobody else sees. Not thread-safe.
class DryRun {
 public:
  // `graph` must outlive this; `facts` are its counts. `proceed` is that of storage::Draft: a status of it other than
  // OK is thrown (StatusError).
  DryRun(const storage::Graph& graph, const storage::MapFacts& facts, storage::Draft::Proceed proceed = {})
      : draft_(graph, facts, std::move(proceed)), recorder_(draft_), sequence_(facts.applied_sequence) {}

  // Makes an edit; the reasons are those of check_edge_edit().
  Status edit(const storage::SetEdgeStateRecord& record);
  // Stores a closure; returns its id.
  EdgeId propose(const storage::ClosureProposalRecord& record);

  // The removal_mark() of a record that removes_all(), in the map with the edits made so far; 0 of another record, or
  // if there is no such edge. Must be called before the removal.
  std::uint64_t removal(const storage::SetEdgeStateRecord& record) const;

  // An edge, which must exist, as the edits leave it.
  storage::Edge edge(EdgeId id) const { return *storage::find_edge(recorder_, id); }
  // What the edits change together, ascending by id.
  std::vector<EdgeChange> changes() const { return recorder_.changes(); }
  // The map as the edits leave it.
  const storage::Graph& outcome() const { return recorder_; }

 private:
  storage::Draft draft_;
  EdgeRecorder recorder_;
  std::uint64_t sequence_;
};

}  // namespace relmap::map
