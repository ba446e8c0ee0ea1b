#include "server/route/overlay/cell.h"

#include <algorithm>
#include <array>

#include "server/route/overlay/disjoint_sets.h"
#include "server/route/passage.h"

namespace relmap::route {

std::uint32_t CellFrames::find(FrameId frame) const {
  const auto at = std::lower_bound(nodes.begin(), nodes.end(), frame);
  return at == nodes.end() || *at != frame ? kNone : static_cast<std::uint32_t>(at - nodes.begin());
}

std::size_t CellFrames::memory_bytes() const {
  return sizeof *this + nodes.capacity() * sizeof(FrameId) + begin.capacity() * sizeof(begin[0]) +
         links.capacity() * sizeof(Link);
}

std::vector<FrameId> ends_of_changed_links(const CellFrames& then, const CellFrames& now) {
  std::vector<FrameId> ends;
  const auto compare = [&](const CellFrames& some, const CellFrames& others) {
    for (std::uint32_t node = 0; node < some.nodes.size(); ++node) {
      const std::uint32_t there = others.find(some.nodes[node]);
      const auto known = there == CellFrames::kNone ? std::span<const Link>() : others.links_of(there);
      for (const Link& link : some.links_of(node))
        if (std::find(known.begin(), known.end(), link) == known.end()) ends.push_back(link.to);
    }
  };
  compare(then, now);
  compare(now, then);
  return ends;
}

CellFrames frames_of(const storage::Graph& graph, storage::ChunkId chunk, const CellFrames* border) {
  CellFrames chunk_frames;
  const RouteFilter all;
  Passage open(graph, all);
  std::array<std::vector<Link>, storage::kFramesPerChunk> links;  // by slot
  const auto take = [&](FrameId frame, const storage::Edge& edge, bool forward) {
    const EdgeCosts cost = costs(edge);
    // The map may be damaged, too, and with negative costs a search has no end.
    links[storage::slot_of(frame)].push_back({forward ? edge.b : edge.a, cost.metres, std::max(0.0, cost.variance_m2),
                                              std::max(0.0f, static_cast<float>(cost.driven_s)),
                                              std::max(0.0f, static_cast<float>(cost.standing_s)), edge.id.ordinal,
                                              edge.support, edge.kind == storage::EdgeKind::kLoop, forward,
                                              open.open(edge, forward), open.open(edge, !forward)});
  };
  const storage::Slots<storage::FrameHot> frames = graph.hot_frames(chunk);
  for (std::uint32_t slot = 0; slot < storage::kFramesPerChunk; ++slot) {
    const FrameId frame = storage::frame_in(chunk, slot);
    const auto& hot = frames[slot];
    if (!hot || !hot->present) continue;
    chunk_frames.nodes.push_back(frame);
    for (const storage::Edge& edge : hot->edges) {
      if (!edge.in_graph()) continue;
      const bool inside = storage::chunk_id(edge.a) == chunk;
      if (inside || !border) take(edge.b, edge, false);
      if (inside) take(edge.a, edge, true);
    }
    for (const EdgeId incoming : hot->incoming) {
      if (border || storage::chunk_id(incoming.frame) == chunk) continue;
      const auto other = graph.hot(incoming.frame);
      const storage::Edge* edge = other ? other->edge(incoming) : nullptr;
      if (edge && edge->in_graph()) take(frame, *edge, true);
    }
  }
  if (border)
    for (std::uint32_t node = 0; node < border->nodes.size(); ++node)
      for (const Link& link : border->links_of(node)) links[storage::slot_of(border->nodes[node])].push_back(link);
  chunk_frames.begin.push_back(0);
  for (const FrameId frame : chunk_frames.nodes) {
    const std::vector<Link>& some = links[storage::slot_of(frame)];
    chunk_frames.links.insert(chunk_frames.links.end(), some.begin(), some.end());
    chunk_frames.begin.push_back(static_cast<std::uint32_t>(chunk_frames.links.size()));
  }
  return chunk_frames;
}

Cell make_cell(const CellFrames& frames, storage::ChunkId chunk, std::span<const RouteWeights> metrics) {
  const auto leaves = [&](const Link& link) { return storage::chunk_id(link.to) != chunk; };
  Cell cell;
  cell.facts.oneway =
      std::any_of(frames.links.begin(), frames.links.end(), [](const Link& link) { return !link.out || !link.in; });
  CellFrames& border = cell.frames;
  border.begin.push_back(0);
  std::vector<std::uint32_t> place(frames.nodes.size());
  std::uint32_t kept = 0, last = static_cast<std::uint32_t>(frames.nodes.size()), sets = last;
  DisjointSets joined(sets);
  for (std::uint32_t n = 0; n < frames.nodes.size(); ++n) {
    const auto links = frames.links_of(n);
    const bool outer = std::any_of(links.begin(), links.end(), leaves);
    place[n] = outer ? kept++ : --last;
    for (const Link& link : links) {
      if (leaves(link)) continue;
      cell.facts.take_in(link);
      if (const std::uint32_t to = frames.find(link.to); to != CellFrames::kNone) sets -= joined.join(n, to);
    }
    if (!outer) continue;
    border.nodes.push_back(frames.nodes[n]);
    std::copy_if(links.begin(), links.end(), std::back_inserter(border.links), leaves);
    border.begin.push_back(static_cast<std::uint32_t>(border.links.size()));
  }
  cell.facts.joined = sets == 1;
  for (const RouteWeights& metric : metrics) {
    CostMatrix within(frames.nodes.size());
    for (std::uint32_t n = 0; n < frames.nodes.size(); ++n)
      for (const Link& link : frames.links_of(n))
        if (!leaves(link) && link.out)
          if (const std::uint32_t to = frames.find(link.to); to != CellFrames::kNone)
            within.offer(place[n], place[to], metric(link.costs()));
    within.eliminate(kept);
    within.close();
    cell.within.push_back(std::move(within));
  }
  return cell;
}

}  // namespace relmap::route
