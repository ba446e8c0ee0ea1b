// Finds what edges join to a frame, in either direction, to explain why there is no route. Each cell knows whether its
// edges connect its frames (CellFacts::joined), so only cells that are not connected or that have changed are opened.
// This takes some milliseconds for a million frames.
#pragma once

#include <set>
#include <span>

#include "server/route/overlay/overlay.h"
#include "server/route/work_limit.h"

namespace relmap::route {

class Reachability {
 public:
  // `stale` are the chunks with frames that changed or came since the overlay was made. Throws StatusError where reads
  // of the graph do, and with what work.proceed returns.
  Reachability(const Overlay& overlay, const storage::Graph& graph, std::span<const storage::ChunkId> stale,
               std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work = {});

  // The sessions of the frames to which any of `from` is joined.
  const std::set<SessionNumber>& sessions() const { return sessions_; }
  // Whether any of `to` is among these frames.
  bool goal() const { return goal_; }

 private:
  std::set<SessionNumber> sessions_;
  bool goal_ = false;
};

// NOT_CONNECTED, with the sessions named, if no edges join any of `from` to any of `to`. Throws like Reachability.
Status check_joined(const Overlay& overlay, const storage::Graph& graph, std::span<const storage::ChunkId> stale,
                    std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work = {});

}  // namespace relmap::route
