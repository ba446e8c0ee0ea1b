#include "server/route/overlay/joining.h"

#include <algorithm>
#include <utility>

namespace relmap::route {

Joining::Joining(std::vector<CellFrames> frames, std::span<const CellFacts> facts)
    : parts_(std::move(frames)), front_nodes_(parts_.size()), alive_(parts_.size(), true) {
  for (const CellFacts& part : facts) facts_.take_in(part);
  for (std::uint32_t p = 0; p < parts_.size(); ++p)
    for (std::uint32_t i = 0; i < parts_[p].nodes.size(); ++i) nodes_.push_back({parts_[p].nodes[i], p, i, p});
  std::sort(nodes_.begin(), nodes_.end(), [](const Node& x, const Node& y) { return x.frame < y.frame; });
  links_.resize(nodes_.size());
  tied_.assign(parts_.size(), std::vector<std::uint32_t>(parts_.size(), 0));
  for (std::size_t p = 0; p < parts_.size(); ++p) front_nodes_[p].resize(parts_[p].nodes.size());
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
    Node& node = nodes_[n];
    front_nodes_[node.part][node.in_part] = n;
    for (const Link& link : parts_[node.part].links_of(node.in_part)) {
      const std::uint32_t to = find(link.to);
      if (to == CellFrames::kNone) {
        node.border = true;
        continue;
      }
      links_[n].push_back({to, &link});
      ++tied_[node.part][nodes_[to].part];
    }
  }
  while (merge_best()) {
  }
  std::size_t apart = 0;  // fronts left of the parts into which an edge leads
  facts_.joined = true;
  for (std::uint32_t p = 0; p < parts_.size(); ++p) {
    if (parts_[p].nodes.empty()) continue;
    facts_.joined &= facts[p].joined;
    apart += alive_[p];
  }
  facts_.joined &= apart == 1;
  border();
}

std::uint32_t Joining::find(FrameId frame) const {
  const auto at = std::lower_bound(nodes_.begin(), nodes_.end(), frame,
                                   [](const Node& node, FrameId wanted) { return node.frame < wanted; });
  return at == nodes_.end() || at->frame != frame ? CellFrames::kNone : static_cast<std::uint32_t>(at - nodes_.begin());
}

bool Joining::merge_best() {
  std::uint32_t best_a = 0, best_b = 0;
  double best = 0;
  for (std::uint32_t a = 0; a < parts_.size(); ++a)
    for (std::uint32_t b = a + 1; b < parts_.size() && alive_[a]; ++b) {
      if (!alive_[b] || tied_[a][b] == 0) continue;
      const double score =
          static_cast<double>(tied_[a][b]) / static_cast<double>(front_nodes_[a].size() + front_nodes_[b].size());
      if (score > best) best = score, best_a = a, best_b = b;
    }
  if (best == 0) return false;
  merge(best_a, best_b);
  return true;
}

void Joining::merge(std::uint32_t a, std::uint32_t b) {
  const auto stays = [&](std::uint32_t n) {
    return nodes_[n].border || std::any_of(links_[n].begin(), links_[n].end(), [&](const InnerLink& link) {
             const Node& to = nodes_[link.to];
             return !to.eliminated && to.front != a && to.front != b;
           });
  };
  std::vector<std::uint32_t> order = front_nodes_[a];
  order.insert(order.end(), front_nodes_[b].begin(), front_nodes_[b].end());
  const auto kept = static_cast<std::size_t>(std::stable_partition(order.begin(), order.end(), stays) - order.begin());
  std::vector<std::uint32_t> place(nodes_.size());  // in `order`
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;

  Merge merge{a, b, order.size(), kept, {}, {}, {}};
  for (const std::uint32_t n : front_nodes_[a]) merge.places_of_a.push_back(place[n]);
  for (const std::uint32_t n : front_nodes_[b]) merge.places_of_b.push_back(place[n]);
  for (const std::uint32_t n : order)
    for (const InnerLink& link : links_[n])
      if (const Node& to = nodes_[link.to]; !to.eliminated && to.front == (nodes_[n].front == a ? b : a))
        if (link.link->out) merge.crossings.push_back({place[n], place[link.to], link.link});
  merges_.push_back(std::move(merge));

  for (std::size_t i = kept; i < order.size(); ++i) nodes_[order[i]].eliminated = true;
  order.resize(kept);
  for (const std::uint32_t n : front_nodes_[b]) nodes_[n].front = a;
  front_nodes_[a] = std::move(order);
  front_nodes_[b].clear();
  alive_[b] = false;
  for (std::uint32_t f = 0; f < parts_.size(); ++f) {
    if (f == a || f == b) continue;
    tied_[a][f] = tied_[f][a] = tied_[a][f] + tied_[b][f];
  }
}

void Joining::border() {
  frames_.begin.push_back(0);
  std::vector<std::uint32_t> place(nodes_.size(), CellFrames::kNone);
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
    for (const InnerLink& inner : links_[n]) facts_.take_in(*inner.link);
    if (!nodes_[n].border) continue;
    place[n] = static_cast<std::uint32_t>(frames_.nodes.size());
    frames_.nodes.push_back(nodes_[n].frame);
    for (const Link& link : parts_[nodes_[n].part].links_of(nodes_[n].in_part))
      if (find(link.to) == CellFrames::kNone) frames_.links.push_back(link);
    frames_.begin.push_back(static_cast<std::uint32_t>(frames_.links.size()));
  }
  for (const std::vector<std::uint32_t>& nodes : front_nodes_) {
    places_.emplace_back();
    for (const std::uint32_t n : nodes) places_.back().push_back(place[n]);
  }
}

CostMatrix Joining::within(const RouteWeights& metric, std::vector<CostMatrix> parts) const {
  for (const Merge& merge : merges_) {
    CostMatrix both(merge.nodes);
    for (const auto& [part, places] : {std::pair(merge.a, &merge.places_of_a), std::pair(merge.b, &merge.places_of_b)})
      for (std::uint32_t i = 0; i < places->size(); ++i) {
        const double* from = parts[part].row(i);
        double* to = both.row((*places)[i]);
        for (std::uint32_t j = 0; j < places->size(); ++j) to[(*places)[j]] = from[j];
      }
    for (const auto& [from, to, link] : merge.crossings) both.offer(from, to, metric(link->costs()));
    both.eliminate(merge.kept);
    parts[merge.a] = std::move(both);
    parts[merge.b] = {};
  }
  CostMatrix within(frames_.nodes.size());
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (std::uint32_t i = 0; i < places_[p].size(); ++i)
      for (std::uint32_t j = 0; j < places_[p].size(); ++j) {
        const std::uint32_t from = places_[p][i], to = places_[p][j];
        if (from != CellFrames::kNone && to != CellFrames::kNone) within.offer(from, to, parts[p](i, j));
      }
  within.close();
  return within;
}

}  // namespace relmap::route
