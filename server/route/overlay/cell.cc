#include "server/route/overlay/cell.h"

#include <algorithm>
#include <array>

#include "server/route/passage.h"

namespace relmap {
namespace {

// Nodes of several cells, and the way in which they are joined two by two: the nested order of elimination of sparse
// solvers, so that no matrix is larger than two neighbouring parts' borders.
class Joining {
 public:
  explicit Joining(std::span<const Cell> cells);
  Cell run(std::span<const RouteWeights> metrics);

 private:
  struct Node {
    FrameId frame;
    const CellFrames* cell;
    std::uint32_t in_cell;  // and at first its place in the front
    std::uint32_t front;
    bool border = false;      // a link leads out of all cells
    bool eliminated = false;  // it lies in the midst of its front
  };
  struct InnerLink {
    std::uint32_t to;  // node
    const Link* link;
  };
  // A part of the cells, joined so far.
  struct Front {
    std::vector<std::uint32_t> nodes;
    std::vector<CostMatrix> within;
    bool alive = true;
  };

  std::uint32_t find(FrameId frame) const;
  bool merge_best(std::span<const RouteWeights> metrics);
  void merge(std::uint32_t a, std::uint32_t b, std::span<const RouteWeights> metrics);

  std::vector<Node> nodes_;                    // by frame
  std::vector<std::vector<InnerLink>> links_;  // by node
  std::vector<Front> fronts_;
  std::vector<std::vector<std::uint32_t>> tied_;  // how many links lead from one front to another
  CellFacts facts_;
};

std::uint32_t Joining::find(FrameId frame) const {
  const auto at = std::lower_bound(nodes_.begin(), nodes_.end(), frame,
                                   [](const Node& node, FrameId wanted) { return node.frame < wanted; });
  return at == nodes_.end() || at->frame != frame ? CellFrames::kNone : static_cast<std::uint32_t>(at - nodes_.begin());
}

Joining::Joining(std::span<const Cell> cells) : fronts_(cells.size()) {
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    facts_.take_in(cells[c].facts);
    const CellFrames& frames = cells[c].frames;
    for (std::uint32_t i = 0; i < frames.nodes.size(); ++i) nodes_.push_back({frames.nodes[i], &frames, i, c});
    fronts_[c].within = cells[c].within;
  }
  std::sort(nodes_.begin(), nodes_.end(), [](const Node& x, const Node& y) { return x.frame < y.frame; });
  links_.resize(nodes_.size());
  tied_.assign(fronts_.size(), std::vector<std::uint32_t>(fronts_.size(), 0));
  for (std::size_t c = 0; c < cells.size(); ++c) fronts_[c].nodes.resize(cells[c].frames.nodes.size());
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
    Node& node = nodes_[n];
    fronts_[node.front].nodes[node.in_cell] = n;
    for (const Link& link : node.cell->links_of(node.in_cell)) {
      const std::uint32_t to = find(link.to);
      if (to == CellFrames::kNone) {
        node.border = true;
        continue;
      }
      links_[n].push_back({to, &link});
      ++tied_[node.front][nodes_[to].front];
    }
  }
}

bool Joining::merge_best(std::span<const RouteWeights> metrics) {
  std::uint32_t best_a = 0, best_b = 0;
  double best = 0;
  for (std::uint32_t a = 0; a < fronts_.size(); ++a)
    for (std::uint32_t b = a + 1; b < fronts_.size() && fronts_[a].alive; ++b) {
      if (!fronts_[b].alive || tied_[a][b] == 0) continue;
      const double score =
          static_cast<double>(tied_[a][b]) / static_cast<double>(fronts_[a].nodes.size() + fronts_[b].nodes.size());
      if (score > best) best = score, best_a = a, best_b = b;
    }
  if (best == 0) return false;
  merge(best_a, best_b, metrics);
  return true;
}

void Joining::merge(std::uint32_t a, std::uint32_t b, std::span<const RouteWeights> metrics) {
  const auto stays = [&](std::uint32_t n) {
    return nodes_[n].border || std::any_of(links_[n].begin(), links_[n].end(), [&](const InnerLink& link) {
             const Node& to = nodes_[link.to];
             return !to.eliminated && to.front != a && to.front != b;
           });
  };
  std::vector<std::uint32_t> order = fronts_[a].nodes;
  order.insert(order.end(), fronts_[b].nodes.begin(), fronts_[b].nodes.end());
  const auto kept = static_cast<std::size_t>(std::stable_partition(order.begin(), order.end(), stays) - order.begin());

  std::vector<CostMatrix> within;
  std::vector<std::uint32_t> place(nodes_.size());  // in `order`
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  for (std::size_t m = 0; m < metrics.size(); ++m) {
    CostMatrix both(order.size());
    for (const std::uint32_t f : {a, b}) {
      const Front& front = fronts_[f];
      for (std::uint32_t i = 0; i < front.nodes.size(); ++i) {
        const double* from = front.within[m].row(i);
        double* to = both.row(place[front.nodes[i]]);
        for (std::uint32_t j = 0; j < front.nodes.size(); ++j) to[place[front.nodes[j]]] = from[j];
      }
    }
    for (const std::uint32_t n : order)
      for (const InnerLink& link : links_[n])
        if (const Node& to = nodes_[link.to]; !to.eliminated && to.front == (nodes_[n].front == a ? b : a))
          if (link.link->out) both.offer(place[n], place[link.to], metrics[m](link.link->costs()));
    both.eliminate(kept);
    within.push_back(std::move(both));
  }
  for (std::size_t i = kept; i < order.size(); ++i) nodes_[order[i]].eliminated = true;
  order.resize(kept);
  for (const std::uint32_t f : {a, b})
    for (const std::uint32_t n : fronts_[f].nodes) nodes_[n].front = a;
  fronts_[a] = {std::move(order), std::move(within), true};
  fronts_[b] = {{}, {}, false};
  for (std::uint32_t f = 0; f < fronts_.size(); ++f) {
    if (f == a || f == b) continue;
    tied_[a][f] = tied_[f][a] = tied_[a][f] + tied_[b][f];
  }
}

Cell Joining::run(std::span<const RouteWeights> metrics) {
  while (merge_best(metrics)) {
  }
  Cell cell;
  cell.facts = facts_;
  CellFrames& frames = cell.frames;
  frames.begin.push_back(0);
  std::vector<std::uint32_t> place(nodes_.size(), CellFrames::kNone);
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
    for (const InnerLink& inner : links_[n]) cell.facts.take_in(*inner.link);
    if (!nodes_[n].border) continue;
    place[n] = static_cast<std::uint32_t>(frames.nodes.size());
    frames.nodes.push_back(nodes_[n].frame);
    for (const Link& link : nodes_[n].cell->links_of(nodes_[n].in_cell))
      if (find(link.to) == CellFrames::kNone) frames.links.push_back(link);
    frames.begin.push_back(static_cast<std::uint32_t>(frames.links.size()));
  }
  for (std::size_t m = 0; m < metrics.size(); ++m) {
    CostMatrix within(frames.nodes.size());
    for (const Front& front : fronts_)
      for (std::uint32_t i = 0; i < front.nodes.size(); ++i)
        for (std::uint32_t j = 0; j < front.nodes.size(); ++j) {
          const std::uint32_t from = place[front.nodes[i]], to = place[front.nodes[j]];
          if (from != CellFrames::kNone && to != CellFrames::kNone) within.offer(from, to, front.within[m](i, j));
        }
    within.close();
    cell.within.push_back(std::move(within));
  }
  return cell;
}

}  // namespace

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

CellFrames frames_of(const Graph& graph, ChunkId chunk, const CellFrames* border) {
  CellFrames chunk_frames;
  const RouteFilter all;
  Passage open(graph, all);
  std::array<std::vector<Link>, kFramesPerChunk> links;  // by slot
  const auto take = [&](FrameId frame, const Edge& edge, bool forward) {
    const EdgeCosts cost = costs(edge);
    links[slot_of(frame)].push_back({forward ? edge.b : edge.a, cost.metres, cost.variance_m2,
                                     static_cast<float>(cost.driven_s), static_cast<float>(cost.standing_s),
                                     edge.id.ordinal, edge.support, edge.kind == EdgeKind::kLoop, forward,
                                     open.open(edge, forward), open.open(edge, !forward)});
  };
  const Slots<FrameHot> frames = graph.hot_frames(chunk);
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    const FrameId frame = frame_in(chunk, slot);
    const auto& hot = frames[slot];
    if (!hot || !hot->present) continue;
    chunk_frames.nodes.push_back(frame);
    for (const Edge& edge : hot->edges) {
      if (!edge.in_graph()) continue;
      const bool inside = chunk_id(edge.a) == chunk;
      if (inside || !border) take(edge.b, edge, false);
      if (inside) take(edge.a, edge, true);
    }
    for (const EdgeId incoming : hot->incoming) {
      if (border || chunk_id(incoming.frame) == chunk) continue;
      const auto other = graph.hot(incoming.frame);
      const Edge* edge = other ? other->edge(incoming) : nullptr;
      if (edge && edge->in_graph()) take(frame, *edge, true);
    }
  }
  if (border)
    for (std::uint32_t node = 0; node < border->nodes.size(); ++node)
      for (const Link& link : border->links_of(node)) links[slot_of(border->nodes[node])].push_back(link);
  chunk_frames.begin.push_back(0);
  for (const FrameId frame : chunk_frames.nodes) {
    const std::vector<Link>& some = links[slot_of(frame)];
    chunk_frames.links.insert(chunk_frames.links.end(), some.begin(), some.end());
    chunk_frames.begin.push_back(static_cast<std::uint32_t>(chunk_frames.links.size()));
  }
  return chunk_frames;
}

Cell make_cell(const CellFrames& frames, ChunkId chunk, std::span<const RouteWeights> metrics) {
  const auto leaves = [&](const Link& link) { return chunk_id(link.to) != chunk; };
  Cell cell;
  cell.facts.oneway =
      std::any_of(frames.links.begin(), frames.links.end(), [](const Link& link) { return !link.out || !link.in; });
  CellFrames& border = cell.frames;
  border.begin.push_back(0);
  std::vector<std::uint32_t> place(frames.nodes.size());
  std::uint32_t kept = 0, last = static_cast<std::uint32_t>(frames.nodes.size());
  for (std::uint32_t n = 0; n < frames.nodes.size(); ++n) {
    const auto links = frames.links_of(n);
    const bool outer = std::any_of(links.begin(), links.end(), leaves);
    place[n] = outer ? kept++ : --last;
    for (const Link& link : links)
      if (!leaves(link)) cell.facts.take_in(link);
    if (!outer) continue;
    border.nodes.push_back(frames.nodes[n]);
    std::copy_if(links.begin(), links.end(), std::back_inserter(border.links), leaves);
    border.begin.push_back(static_cast<std::uint32_t>(border.links.size()));
  }
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

Cell join(std::span<const Cell> cells, std::span<const RouteWeights> metrics) { return Joining(cells).run(metrics); }

}  // namespace relmap
