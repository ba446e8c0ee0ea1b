#include "server/route/overlay/stale.h"

#include <vector>

namespace relmap::route {

std::unordered_map<storage::ChunkId, CellFrames> frames_of_stale(const Overlay& overlay, const storage::Graph& graph,
                                                                 std::span<const storage::ChunkId> changed,
                                                                 const WorkLimit& work) {
  static const auto kNothing = std::make_shared<const CellFrames>();
  std::unordered_map<storage::ChunkId, CellFrames> stale;
  std::size_t bytes = 0;
  for (std::vector<storage::ChunkId> open(changed.begin(), changed.end()); !open.empty();) {
    const storage::ChunkId chunk = open.back();
    open.pop_back();
    if (stale.contains(chunk)) continue;
    if (work.proceed)
      if (Status status = work.proceed(bytes); !status.ok()) throw StatusError(status);
    const CellFrames& frames = stale[chunk] = frames_of(graph, chunk);
    bytes += frames.memory_bytes();
    const std::uint32_t number = overlay.tree().find(chunk);
    const auto then = number == CellTree::kNone ? kNothing : overlay.cell(number)->frames();
    for (const FrameId end : ends_of_changed_links(*then, frames))
      // Links within the chunk always differ, since the cell has none.
      if (storage::chunk_id(end) != chunk) open.push_back(storage::chunk_id(end));
  }
  return stale;
}

}  // namespace relmap::route
