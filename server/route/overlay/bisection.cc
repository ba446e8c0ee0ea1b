#include "server/route/overlay/bisection.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <queue>
#include <random>

namespace relmap::route {
namespace {

constexpr std::uint32_t kNoNode = ~0u;
constexpr std::uint32_t kCoarsest = 60;  // nodes
constexpr int kStarts = 6;               // nodes from which a side is grown; the best result is kept
constexpr int kPasses = 4;               // passes of refinement at each level
constexpr std::size_t kPatience = 120;   // moves without gain after which a pass ends

using Sides = std::vector<std::uint8_t>;

std::uint64_t total(const std::vector<std::uint32_t>& sizes) {
  return std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{0});
}

// Matches each node with the neighbour to which it has the heaviest arc for the neighbour's size; nodes without a free
// neighbour stay alone. Returns the coarse node of each node.
std::vector<std::uint32_t> match(const WeightedGraph& graph, std::uint64_t max_size, std::mt19937& random,
                                 std::uint32_t& coarse_nodes) {
  std::vector<std::uint32_t> order(graph.nodes()), coarse(graph.nodes(), kNoNode);
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), random);
  coarse_nodes = 0;
  for (const std::uint32_t v : order) {
    if (coarse[v] != kNoNode) continue;
    std::uint32_t best = kNoNode;
    double best_rating = 0;
    for (std::uint32_t i = graph.begin[v]; i < graph.begin[v + 1]; ++i) {
      const auto [u, weight] = graph.arcs[i];
      if (coarse[u] != kNoNode || std::uint64_t{graph.size[u]} + graph.size[v] > max_size) continue;
      const double rating = double{static_cast<double>(weight)} / graph.size[u];
      if (best == kNoNode || rating > best_rating) best = u, best_rating = rating;
    }
    coarse[v] = coarse_nodes;
    if (best != kNoNode) coarse[best] = coarse_nodes;
    ++coarse_nodes;
  }
  return coarse;
}

WeightedGraph contract(const WeightedGraph& graph, const std::vector<std::uint32_t>& coarse, std::uint32_t nodes) {
  std::vector<std::uint32_t> sizes(nodes, 0);
  std::vector<WeightedPair> pairs;
  pairs.reserve(graph.arcs.size() / 2);
  for (std::uint32_t v = 0; v < graph.nodes(); ++v) {
    sizes[coarse[v]] += graph.size[v];
    for (std::uint32_t i = graph.begin[v]; i < graph.begin[v + 1]; ++i)
      if (const auto [u, weight] = graph.arcs[i]; v < u && coarse[v] != coarse[u])
        pairs.push_back({coarse[v], coarse[u], weight});
  }
  return make_weighted_graph(std::move(sizes), std::move(pairs));
}

// Moves nodes between the sides, best gain first and each at most once a pass, and takes back the moves after the best
// state.
class Refinement {
 public:
  Refinement(const WeightedGraph& graph, std::uint64_t max_size) : graph_(graph), max_size_(max_size) {}

  void run(Sides& side) {
    for (int pass = 0; pass < kPasses; ++pass)
      if (!improve(side)) break;
  }

 private:
  struct Entry {
    std::int64_t gain;
    std::uint32_t node;
    bool operator<(const Entry& other) const { return gain != other.gain ? gain < other.gain : node > other.node; }
  };

  std::int64_t gain_of(const Sides& side, std::uint32_t v) const {
    std::int64_t gain = 0;
    for (std::uint32_t i = graph_.begin[v]; i < graph_.begin[v + 1]; ++i) {
      const auto [u, weight] = graph_.arcs[i];
      gain += side[u] != side[v] ? std::int64_t{weight} : -std::int64_t{weight};
    }
    return gain;
  }
  std::uint64_t excess(const std::uint64_t* sizes) const {
    const std::uint64_t larger = std::max(sizes[0], sizes[1]);
    return larger > max_size_ ? larger - max_size_ : 0;
  }

  bool improve(Sides& side) {
    std::uint64_t sizes[2] = {0, 0};
    std::priority_queue<Entry> queues[2];  // by the side on which a node is
    std::vector<std::int64_t> gains(graph_.nodes());
    for (std::uint32_t v = 0; v < graph_.nodes(); ++v) {
      sizes[side[v]] += graph_.size[v];
      gains[v] = gain_of(side, v);
      bool at_border = false;
      for (std::uint32_t i = graph_.begin[v]; i < graph_.begin[v + 1] && !at_border; ++i)
        at_border = side[graph_.arcs[i].to] != side[v];
      if (at_border || graph_.nodes() <= kCoarsest) queues[side[v]].push({gains[v], v});
    }
    std::vector<bool> moved(graph_.nodes(), false);
    std::vector<std::uint32_t> moves;
    std::int64_t gained = 0, best_gained = 0;
    const std::uint64_t excess_before = excess(sizes);
    std::uint64_t best_excess = excess_before;
    std::size_t kept = 0;
    while (moves.size() < kept + kPatience) {
      const int from = choose(queues, gains, moved, side, sizes);
      if (from < 0) break;
      const std::uint32_t v = queues[from].top().node;
      queues[from].pop();
      moved[v] = true;
      moves.push_back(v);
      gained += gains[v];
      sizes[from] -= graph_.size[v];
      sizes[1 - from] += graph_.size[v];
      side[v] = static_cast<std::uint8_t>(1 - from);
      for (std::uint32_t i = graph_.begin[v]; i < graph_.begin[v + 1]; ++i) {
        const auto [u, weight] = graph_.arcs[i];
        if (moved[u]) continue;
        gains[u] += side[u] == side[v] ? -2 * std::int64_t{weight} : 2 * std::int64_t{weight};
        queues[side[u]].push({gains[u], u});
      }
      const std::uint64_t now = excess(sizes);
      if (now < best_excess || (now == best_excess && gained > best_gained)) {
        best_excess = now;
        best_gained = gained;
        kept = moves.size();
      }
    }
    for (std::size_t i = moves.size(); i > kept; --i) side[moves[i - 1]] ^= 1;
    return best_excess < excess_before || best_gained > 0;
  }

  // The side from which the best node may move; -1 if none may.
  int choose(std::priority_queue<Entry>* queues, const std::vector<std::int64_t>& gains, const std::vector<bool>& moved,
             const Sides& side, const std::uint64_t* sizes) const {
    int best = -1;
    for (int from = 0; from < 2; ++from) {
      auto& queue = queues[from];
      while (!queue.empty() &&
             (moved[queue.top().node] || side[queue.top().node] != from || gains[queue.top().node] != queue.top().gain))
        queue.pop();
      if (queue.empty()) continue;
      const std::uint32_t size = graph_.size[queue.top().node];
      if (sizes[from] <= size) continue;  // the side would be empty
      const bool heavy = sizes[from] > max_size_;
      if (sizes[1 - from] + size > max_size_ && !heavy) continue;
      if (heavy) return from;
      if (best < 0 || queues[best].top() < queue.top()) best = from;
    }
    return best;
  }

  const WeightedGraph& graph_;
  const std::uint64_t max_size_;
};

// Grows one side from a node until it has half of the whole, each time by the node that increases the cut least.
Sides grow(const WeightedGraph& graph, std::uint32_t start, std::uint64_t half) {
  Sides side(graph.nodes(), 0);
  std::vector<std::int64_t> tie(graph.nodes(), 0);
  std::priority_queue<std::pair<std::int64_t, std::uint32_t>> next;
  std::uint64_t grown = 0;
  std::uint32_t unseen = 0;
  next.push({0, start});
  while (grown < half) {
    std::uint32_t v = kNoNode;
    while (!next.empty() && v == kNoNode) {
      if (side[next.top().second] == 0) v = next.top().second;
      next.pop();
    }
    while (v == kNoNode && unseen < graph.nodes()) {  // another component
      if (side[unseen] == 0) v = unseen;
      ++unseen;
    }
    if (v == kNoNode) break;
    if (grown > 0 && grown + graph.size[v] > half + graph.size[v] / 2) break;
    side[v] = 1;
    grown += graph.size[v];
    for (std::uint32_t i = graph.begin[v]; i < graph.begin[v + 1]; ++i) {
      const auto [u, weight] = graph.arcs[i];
      if (side[u] == 1) continue;
      tie[u] += 2 * std::int64_t{weight};
      std::int64_t all = 0;
      for (std::uint32_t j = graph.begin[u]; j < graph.begin[u + 1]; ++j) all += graph.arcs[j].weight;
      next.push({tie[u] - all, u});
    }
  }
  return side;
}

Sides bisect_coarsest(const WeightedGraph& graph, std::uint64_t max_size, std::mt19937& random) {
  const std::uint64_t half = (total(graph.size) + 1) / 2;
  Sides best;
  std::uint64_t best_cut = 0, best_excess = 0;
  for (int i = 0; i < kStarts; ++i) {
    Sides side = grow(graph, static_cast<std::uint32_t>(random() % graph.nodes()), half);
    Refinement(graph, max_size).run(side);
    std::uint64_t sizes[2] = {0, 0};
    for (std::uint32_t v = 0; v < graph.nodes(); ++v) sizes[side[v]] += graph.size[v];
    const std::uint64_t larger = std::max(sizes[0], sizes[1]), excess = larger > max_size ? larger - max_size : 0;
    const std::uint64_t cut = cut_of(graph, side);
    if (!best.empty() && (excess > best_excess || (excess == best_excess && cut >= best_cut))) continue;
    best = std::move(side);
    best_cut = cut;
    best_excess = excess;
  }
  return best;
}

}  // namespace

WeightedGraph make_weighted_graph(std::vector<std::uint32_t> sizes, std::vector<WeightedPair> pairs) {
  WeightedGraph graph;
  graph.size = std::move(sizes);
  const std::size_t given = pairs.size();
  for (std::size_t i = 0; i < given; ++i) pairs.push_back({pairs[i].b, pairs[i].a, pairs[i].weight});
  std::sort(pairs.begin(), pairs.end(),
            [](const WeightedPair& x, const WeightedPair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
  graph.begin.assign(graph.size.size() + 1, 0);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].a == pairs[i].b) continue;
    if (i > 0 && pairs[i].a == pairs[i - 1].a && pairs[i].b == pairs[i - 1].b) {
      graph.arcs.back().weight += pairs[i].weight;
      continue;
    }
    graph.arcs.push_back({pairs[i].b, pairs[i].weight});
    ++graph.begin[pairs[i].a + 1];
  }
  for (std::size_t v = 0; v + 1 < graph.begin.size(); ++v) graph.begin[v + 1] += graph.begin[v];
  return graph;
}

std::uint64_t cut_of(const WeightedGraph& graph, const std::vector<std::uint8_t>& side) {
  std::uint64_t cut = 0;
  for (std::uint32_t v = 0; v < graph.nodes(); ++v)
    for (std::uint32_t i = graph.begin[v]; i < graph.begin[v + 1]; ++i)
      if (side[v] < side[graph.arcs[i].to]) cut += graph.arcs[i].weight;
  return cut;
}

std::vector<std::uint8_t> bisect(const WeightedGraph& graph, double max_share) {
  if (graph.nodes() < 2) return Sides(graph.nodes(), 0);
  std::mt19937 random(graph.nodes());
  const std::uint64_t whole = total(graph.size);
  const auto max_size = static_cast<std::uint64_t>(max_share * static_cast<double>(whole));
  std::vector<WeightedGraph> levels;
  std::vector<std::vector<std::uint32_t>> coarse;  // for each node of level i, its node of level i + 1
  const auto finest = [&](std::size_t level) -> const WeightedGraph& { return level == 0 ? graph : levels[level - 1]; };
  while (finest(levels.size()).nodes() > kCoarsest) {
    const WeightedGraph& fine = finest(levels.size());
    std::uint32_t nodes = 0;
    auto joined = match(fine, std::max<std::uint64_t>(whole / 20, 2), random, nodes);
    if (nodes > fine.nodes() / 20 * 19) break;
    WeightedGraph contracted = contract(fine, joined, nodes);
    coarse.push_back(std::move(joined));
    levels.push_back(std::move(contracted));
  }
  Sides side = bisect_coarsest(finest(levels.size()), max_size, random);
  for (std::size_t level = levels.size(); level-- > 0;) {
    const WeightedGraph& fine = finest(level);
    Sides finer(fine.nodes());
    for (std::uint32_t v = 0; v < fine.nodes(); ++v) finer[v] = side[coarse[level][v]];
    side = std::move(finer);
    Refinement(fine, max_size).run(side);
  }
  return side;
}

}  // namespace relmap::route
