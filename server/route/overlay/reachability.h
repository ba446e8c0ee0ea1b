// What edges join a frame to, whatever their direction: asked when no route was found, to say why. Of the cells of
// chunks alone, so that it takes milliseconds where a search through all frames takes seconds.
#pragma once

#include <set>
#include <span>

#include "server/route/overlay/overlay.h"

namespace relmap {

class Reachability {
 public:
  // `stale`: chunks of which frames changed, or came, since the overlay was made. Throws StatusError where reads of the
  // graph do.
  Reachability(const Overlay& overlay, const Graph& graph, std::span<const ChunkId> stale,
               std::span<const FrameId> from, std::span<const FrameId> to);

  // Of the frames that any of `from` is joined to.
  const std::set<SessionNumber>& sessions() const { return sessions_; }
  // Any of `to` is among these.
  bool goal() const { return goal_; }

 private:
  std::set<SessionNumber> sessions_;
  bool goal_ = false;
};

}  // namespace relmap
