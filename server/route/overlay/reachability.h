// What edges join a frame to, in either direction: asked when no route was found, to say why. Each cell knows whether
// its frames hang together (CellFacts::joined), so that only those are opened that do not, or that changed: some
// milliseconds a million frames.
#pragma once

#include <set>
#include <span>

#include "server/route/overlay/overlay.h"
#include "server/route/work_limit.h"

namespace relmap::route {

class Reachability {
 public:
  // `stale`: chunks of which frames changed, or came, since the overlay was made. Throws StatusError where reads of the
  // graph do, and what work.proceed says.
  Reachability(const Overlay& overlay, const storage::Graph& graph, std::span<const storage::ChunkId> stale,
               std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work = {});

  // Of the frames that any of `from` is joined to.
  const std::set<SessionNumber>& sessions() const { return sessions_; }
  // Any of `to` is among these.
  bool goal() const { return goal_; }

 private:
  std::set<SessionNumber> sessions_;
  bool goal_ = false;
};

// NOT_CONNECTED, with the sessions named, if no edges join any of `from` to any of `to`. Throws as Reachability does.
Status check_joined(const Overlay& overlay, const storage::Graph& graph, std::span<const storage::ChunkId> stale,
                    std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work = {});

}  // namespace relmap::route
