#include "server/route/overlay/stale.h"

#include <vector>

namespace relmap {

std::unordered_map<ChunkId, CellFrames> frames_of_stale(const Overlay& overlay, const Graph& graph,
                                                        std::span<const ChunkId> changed, const WorkLimit& work) {
  static const auto kNothing = std::make_shared<const CellFrames>();
  std::unordered_map<ChunkId, CellFrames> stale;
  std::size_t bytes = 0;
  for (std::vector<ChunkId> open(changed.begin(), changed.end()); !open.empty();) {
    const ChunkId chunk = open.back();
    open.pop_back();
    if (stale.contains(chunk)) continue;
    if (work.proceed)
      if (Status status = work.proceed(bytes); !status.ok()) throw StatusError(status);
    const CellFrames& frames = stale[chunk] = frames_of(graph, chunk);
    bytes += frames.memory_bytes();
    const std::uint32_t number = overlay.tree().find(chunk);
    const auto then = number == CellTree::kNone ? kNothing : overlay.cell(number)->frames();
    for (const FrameId end : ends_of_changed_links(*then, frames))
      if (chunk_id(end) != chunk) open.push_back(chunk_id(end));  // the cell has no links within
  }
  return stale;
}

}  // namespace relmap
