#include "storage/maintenance/rebuild.h"

#include "storage/maintenance/recount.h"
#include "storage/maintenance/references.h"
#include "storage/maintenance/verify.h"

namespace relmap::storage {
namespace {

constexpr int kRounds = 4;  // what one round rebuilds (incoming edges) other items follow from (support)

// Writes a derived item to the map as it should be.
void rebuild(Map& map, const Difference& difference) {
  FrameHot& frame = map.edit_hot(difference.frame);
  switch (difference.kind) {
    case Derived::kIncoming:
      frame.incoming = difference.incoming;
      return;
    case Derived::kObservers:
      frame.landmarks[difference.slot].observers = difference.observers;
      return;
    case Derived::kUnreached:
      frame.unreached = difference.unreached;
      return;
    case Derived::kSupport: {
      Edge& edge = *frame.edge(difference.edge);
      edge.support = difference.count;
      edge.prior_active = needs_prior(edge, edge.support);
      return;
    }
    case Derived::kBound:
      frame.edge(difference.edge)->bound = static_cast<std::uint16_t>(difference.count);
      return;
    case Derived::kConsistent:
      frame.edge(difference.edge)->consistent_with = difference.closures;
      return;
    case Derived::kCarriedBy:
      frame.edge(difference.edge)->carried_by = difference.closures;
      return;
  }
}

// One round. Returns how many items it corrected.
std::uint64_t rebuild_once(Map& map, Engine& engine, std::size_t memory_bytes, const OnFinding& on_finding,
                           const OnProgress& on_progress) {
  std::uint64_t rebuilt = 0;
  const auto summary =
      verify(*engine.snapshot(), {{}, memory_bytes / 2}, {}, on_progress, [&](const Difference& difference) {
        rebuild(map, difference);
        ++rebuilt;
        if (on_finding) on_finding({Reason::CORRUPT, difference.frame, difference.what, true});
        if (map.dirty_bytes() > memory_bytes / 8) throw_if(map.commit());
      }).or_throw();
  if (!summary.complete) throw StatusError(Status(Reason::SHUTTING_DOWN, "stopped; it can be run again"));
  if (rebuilt > 0) throw_if(map.commit());
  return rebuilt;
}

}  // namespace

Result<std::uint64_t> rebuild_derived(Map& map, Engine& engine, std::size_t memory_bytes, const OnFinding& on_finding,
                                      const OnProgress& on_progress) try {
  std::uint64_t rebuilt = 0;
  for (int round = 0; round < kRounds; ++round) {
    const std::uint64_t more = rebuild_once(map, engine, memory_bytes, on_finding, on_progress);
    if (more == 0) return rebuilt;
    rebuilt += more;
  }
  return Status(Reason::INTERNAL, "what is derived is not right after having been rebuilt");
} catch (const StatusError& error) {
  return error.status();
}

}  // namespace relmap::storage
