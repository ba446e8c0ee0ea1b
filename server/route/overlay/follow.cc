#include <algorithm>
#include <array>
#include <queue>

#include "server/route/overlay/overlay_search.h"
#include "server/route/refusal.h"

namespace relmap::route {
namespace {

// Finds paths through a chunk by its own frames and edges.
class Inside {
 public:
  // `passage` holds the border frames of the chunk's cell.
  Inside(const storage::Graph& graph, storage::ChunkId chunk, const CellFrames& passage, const RouteWeights& weights,
         Passage& open)
      : chunk_(chunk), frames_(graph.hot_frames(chunk)), passage_(passage), weights_(weights), open_(open) {}

  // Appends the path from one border frame to another to the route. False if there is none.
  bool follow(FrameId from, FrameId to, double cost, Route& route) {
    if (!as_driven(storage::slot_of(from), storage::slot_of(to), cost) &&
        !search(storage::slot_of(from), storage::slot_of(to)))
      return false;
    for (const Step& step : steps_) {
      route.path.turns.push_back(turn(step));
      route.count(*step.edge, step.cost);
    }
    return true;
  }

 private:
  struct Step {
    std::uint32_t slot;  // the frame before the edge
    const storage::Edge* edge;
    double cost;
  };

  const storage::Edge* motion_to(std::uint32_t slot) const {
    return frames_[slot] ? frames_[slot]->edge({storage::frame_in(chunk_, slot), 0}) : nullptr;
  }
  bool leaves(const storage::Edge& edge) const { return storage::chunk_id(edge.a) != chunk_; }

  // Whether the path along the robot's motion, forward or back, has the cost of the cell; if so, sets steps_ to it.
  bool as_driven(std::uint32_t from, std::uint32_t to, double cost) {
    steps_.clear();
    double driven = 0;
    for (std::uint32_t at = from; at != to; at += from < to ? 1 : -1) {
      const bool forward = from < to;
      const storage::Edge* edge = motion_to(forward ? at + 1 : at);
      if (!edge || !edge->in_graph() || edge->a != storage::frame_in(chunk_, forward ? at : at - 1) ||
          !open_.open(*edge, forward))
        return false;
      steps_.push_back({at, edge, weights_(*edge)});
      driven += steps_.back().cost;
      if (driven > cost * (1 + SplitCostMatrix::kPrecision)) return false;
    }
    return true;
  }

  // Calls `visit` with each edge of the graph between this frame and another of the chunk.
  template <typename Visit>
  void visit_edges(std::uint32_t slot, const Visit& visit) const {
    const storage::FrameHot& frame = *frames_[slot];
    for (const storage::Edge& edge : frame.edges)
      if (edge.in_graph() && !leaves(edge)) visit(edge, false);
    for (const EdgeId incoming : frame.incoming) {
      if (storage::chunk_id(incoming.frame) != chunk_) continue;
      const auto& other = frames_[storage::slot_of(incoming.frame)];
      const storage::Edge* edge = other ? other->edge(incoming) : nullptr;
      if (edge && edge->in_graph()) visit(*edge, true);
    }
  }

  bool search(std::uint32_t from, std::uint32_t to) {
    std::array<double, storage::kFramesPerChunk> cost;
    std::array<Step, storage::kFramesPerChunk> came{};
    cost.fill(kUnreachable);
    using Offer = std::pair<double, std::uint32_t>;
    std::priority_queue<Offer, std::vector<Offer>, std::greater<>> queue;
    queue.push({cost[from] = 0, from});
    while (!queue.empty() && queue.top().second != to) {
      const auto [best, slot] = queue.top();
      queue.pop();
      if (best > cost[slot]) continue;
      visit_edges(slot, [&, here = slot, so_far = best](const storage::Edge& edge, bool forward) {
        const std::uint32_t end = storage::slot_of(forward ? edge.b : edge.a);
        const double more = weights_(edge);
        if (!frames_[end] || so_far + more >= cost[end] || !open_.open(edge, forward)) return;
        came[end] = {here, &edge, more};
        queue.push({cost[end] = so_far + more, end});
      });
    }
    if (cost[to] == kUnreachable) return false;
    steps_.clear();
    for (std::uint32_t slot = to; slot != from; slot = came[slot].slot) steps_.push_back(came[slot]);
    std::reverse(steps_.begin(), steps_.end());
    return true;
  }

  // The edge's index among the neighbours() of the frame.
  std::uint16_t turn(const Step& step) const {
    std::uint16_t before = 0;
    visit_edges(step.slot, [&](const storage::Edge& edge, bool) { before += edge.id < step.edge->id; });
    const std::uint32_t node = passage_.find(storage::frame_in(chunk_, step.slot));
    if (node != CellFrames::kNone)
      for (const Link& link : passage_.links_of(node)) before += link.edge(passage_.nodes[node]) < step.edge->id;
    return before;
  }

  const storage::ChunkId chunk_;
  const storage::Slots<storage::FrameHot> frames_;
  const CellFrames& passage_;
  const RouteWeights& weights_;
  Passage& open_;
  std::vector<Step> steps_;
};

}  // namespace

Result<Route> follow(const Overlay& overlay, const storage::Graph& graph, std::size_t metric, const OverlayRoute& route,
                     bool count_standing, const WorkLimit& work) {
  const RouteWeights& weights = overlay.metrics()[metric];
  const RouteFilter all;  // the search has opened cells that hold anything refused
  Passage open(graph, all);
  Route found;
  found.path.from = route.from;
  found.path.to = route.to;
  found.frames_touched = route.nodes_settled;
  found.count_standing = count_standing || weights.standing_second > 0;
  std::vector<std::uint16_t>& turns = found.path.turns;
  for (std::size_t i = 0; i < route.hops.size(); ++i) {
    const Hop& hop = route.hops[i];
    if (i % kWorkStride == 0 && work.proceed)
      if (Status status = work.proceed(found.path.memory_bytes()); !status.ok()) return status;
    if (hop.cell == CellTree::kNone) {
      const auto hot = graph.hot(hop.from);
      if (!hot) return no_such_frame(hop.from);
      const auto steps = storage::neighbours(graph, hop.from, *hot);
      const auto step =
          std::find_if(steps.begin(), steps.end(), [&](const storage::Neighbour& n) { return n.edge == hop.edge; });
      const EdgeRef edge(graph, hop.from, hot, {hop.edge, hop.to, hop.forward});
      turns.push_back(static_cast<std::uint16_t>(step - steps.begin()));
      found.count(*edge, weights(*edge));
      continue;
    }
    const auto passage = overlay.cell(hop.cell)->frames();
    if (!Inside(graph, storage::chunk_id(hop.from), *passage, weights, open).follow(hop.from, hop.to, hop.cost, found))
      return {Reason::DATA_LOSS, "the path from frame " + hop.from.to_string() + " to " + hop.to.to_string() +
                                     " is gone that their chunk's cell was made of"};
  }
  std::reverse(turns.begin(), turns.end());
  turns.shrink_to_fit();
  return found;
}

}  // namespace relmap::route
