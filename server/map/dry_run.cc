#include "server/map/dry_run.h"

#include "server/map/propose.h"

namespace relmap::map {

Status DryRun::edit(const storage::SetEdgeStateRecord& record) {
  if (Status possible = check_edge_edit(recorder_, record); !possible.ok()) return possible;
  apply_edge_edit(recorder_, ++sequence_, record);
  return {};
}

EdgeId DryRun::propose(const storage::ClosureProposalRecord& record) {
  apply_proposal(recorder_, ++sequence_, record);
  return closure_between(recorder_, record.query, record.match)->id;
}

std::uint64_t DryRun::removal(const storage::SetEdgeStateRecord& record) const {
  if (!removes_all(record) || !storage::find_edge(recorder_, record.edge)) return 0;
  return removal_mark(recorder_, record.edge);
}

}  // namespace relmap::map
