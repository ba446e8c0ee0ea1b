#include "server/route/overlay/overlay_search.h"

#include <algorithm>
#include <deque>
#include <queue>
#include <unordered_map>

#include "server/route/overlay/labels.h"
#include "server/route/overlay/reachability.h"
#include "server/route/overlay/stale.h"
#include "server/route/refusal.h"

namespace relmap::route {
namespace {

// Nodes of a place are left together if their costs exceed that of the nearest one by at most this share.
constexpr double kAhead = 0.2;

constexpr std::size_t kPlacesBetweenLooks = 16;  // between calls of proceed

// From the start along the edges, or from the goal against them.
enum Direction : std::uint8_t { kForward = 0, kBackward = 1 };

// Scratch memory by cell, used by one search after another.
struct Marks {
  explicit Marks(const CellTree& tree) : place(tree.size(), CellFrames::kNone), opened(tree.size()) {}
  std::vector<std::uint32_t> place;
  std::vector<bool> opened;
};

// Bidirectional search (Pohl 1971) over the cells and frames within one cell, or within the whole map.
class Search {
 public:
  Search(const Overlay& overlay, const storage::Graph& graph, const OverlayQuery& query, std::uint32_t within,
         Marks& marks, const WorkLimit& work)
      : overlay_(overlay),
        tree_(overlay.tree()),
        graph_(graph),
        query_(query),
        filtered_(!query.filter.refuses_nothing()),
        weights_(overlay.metrics()[query.metric]),
        within_(within),
        marks_(marks),
        work_(work) {}
  ~Search() {
    for (const Place& place : places_)
      if (place.number != CellTree::kNone) marks_.place[place.number] = CellFrames::kNone;
    for (const std::uint32_t cell : opened_) marks_.opened[cell] = false;
  }
  Search(const Search&) = delete;
  Search& operator=(const Search&) = delete;

  // Opens a cell and all cells around it: they are not passed, but their parts are searched, down to the frames of the
  // cell if that is a chunk.
  void open_around(std::uint32_t cell) {
    for (; cell != CellTree::kNone && cell != within_ && !marks_.opened[cell]; cell = tree_.parent(cell)) {
      marks_.opened[cell] = true;
      opened_.push_back(cell);
    }
  }
  // Uses the graph instead of the overlay for these chunks and for edges to them.
  void open_stale(std::span<const storage::ChunkId> stale);
  // Adds a frame at which the search begins in this direction. A frame that the filter refuses is left out.
  Status begin(FrameId frame, Direction direction);
  bool has_begun(Direction direction) const { return !queues_[direction].empty(); }
  // Returns the cheapest route; nullopt if there is none. `enough` is the cost of the route if that is known.
  Result<std::optional<OverlayRoute>> run(double enough = -1);

 private:
  // A part of the map as this search sees it.
  struct Place {
    std::uint32_t number;      // in the tree; kNone for a chunk that the tree does not hold
    const StoredCell* passed;  // null for a chunk that is opened
    std::shared_ptr<const CellFrames> frames;
    std::shared_ptr<const SplitCostMatrix> within[2];  // null until it is passed in this direction
    Labels labels[2];                                  // Labels::came is a packed At: of this place if that was passed
  };
  struct At {
    std::uint32_t place, node;
    std::uint64_t packed() const { return (std::uint64_t{place} << 32) | node; }
    static At unpack(std::uint64_t bits) {
      return {static_cast<std::uint32_t>(bits >> 32), static_cast<std::uint32_t>(bits)};
    }
  };
  static constexpr std::uint32_t kPending = ~0u;
  struct Offer {
    double cost;
    At at;  // a node that is to be entered; or kPending: the nodes that pend in a place that was passed
    bool operator>(const Offer& other) const {
      return cost != other.cost ? cost > other.cost : at.packed() > other.at.packed();
    }
  };
  using Queue = std::priority_queue<Offer, std::vector<Offer>, std::greater<>>;

  bool is_passed(std::uint32_t cell) const { return !marks_.opened[cell] && overlay_.is_current(cell); }
  // The place and node of a frame; nullopt if it is not within within_.
  std::optional<At> locate(FrameId frame);
  std::optional<At> end_of(const Link& link);
  std::uint32_t place_of(std::uint32_t number);
  std::uint32_t add_place(std::uint32_t number, const StoredCell* passed, std::shared_ptr<const CellFrames> frames);
  std::uint32_t add_opened(std::uint32_t number, CellFrames frames) {
    place_bytes_ += frames.memory_bytes();
    ++chunks_opened_;
    return add_place(number, nullptr, std::make_shared<const CellFrames>(std::move(frames)));
  }
  bool is_refused(const Link& link) const {
    return filtered_ && (link.support < query_.filter.min_support || (!query_.filter.long_loops && link.long_loop()));
  }
  // A cell that holds a refused frame is opened, so a place that is passed needs no check.
  bool is_refused(const Place& place, FrameId frame) const {
    return filtered_ && !place.passed && !query_.filter.passes(frame);
  }
  bool offer(Direction direction, At at, double cost, At from);
  void walk_links(Direction direction, At at, double cost);
  void settle(Direction direction);
  void enter(Direction direction, At at, double cost);
  void leave(Direction direction, std::uint32_t place, double cost);
  double min_cost(Direction direction) const {
    return queues_[direction].empty() ? kUnreachable : queues_[direction].top().cost;
  }
  std::size_t memory_bytes() const {
    return marks_.place.size() * sizeof(marks_.place[0]) + place_bytes_ +
           (queues_[kForward].size() + queues_[kBackward].size()) * sizeof(Offer);
  }
  OverlayRoute trace() const;
  void trace(Direction direction, std::vector<Hop>& hops, FrameId& end) const;

  const Overlay& overlay_;
  const CellTree& tree_;
  const storage::Graph& graph_;
  const OverlayQuery& query_;
  const bool filtered_;
  const RouteWeights weights_;
  const std::uint32_t within_;
  Marks& marks_;
  const WorkLimit& work_;
  std::vector<std::uint32_t> opened_;
  std::unordered_map<storage::ChunkId, CellFrames> stale_;          // their frames
  std::unordered_map<storage::ChunkId, std::uint32_t> new_places_;  // of chunks that the tree does not hold
  std::deque<Place> places_;
  Queue queues_[2];
  std::vector<std::uint32_t> due_;
  double best_ = kUnreachable;  // cost of the best complete route so far
  At meeting_{};
  std::uint64_t settled_ = 0;
  std::size_t place_bytes_ = 0;
  std::uint32_t chunks_opened_ = 0;
};

void Search::open_stale(std::span<const storage::ChunkId> stale) {
  stale_ = frames_of_stale(overlay_, graph_, stale, work_);
  for (const auto& [chunk, frames] : stale_) {
    open_around(tree_.find(chunk));
    place_bytes_ += frames.memory_bytes();
  }
}

std::uint32_t Search::add_place(std::uint32_t number, const StoredCell* passed,
                                std::shared_ptr<const CellFrames> frames) {
  if (places_.size() % kPlacesBetweenLooks == 0 && work_.proceed)  // each place may be read from disk
    if (Status status = work_.proceed(memory_bytes()); !status.ok()) throw StatusError(status);
  const std::size_t nodes = frames->nodes.size();
  places_.push_back({number, passed, std::move(frames), {}, {Labels(nodes), Labels(nodes)}});
  place_bytes_ += sizeof(Place) + nodes * 50;
  return static_cast<std::uint32_t>(places_.size() - 1);
}

std::uint32_t Search::place_of(std::uint32_t number) {
  std::uint32_t& place = marks_.place[number];
  if (place != CellFrames::kNone) return place;
  const StoredCell* cell = overlay_.cell(number);
  if (is_passed(number)) return place = add_place(number, cell, cell->frames());
  const storage::ChunkId chunk = tree_.node(number).chunk;
  const auto stale = stale_.find(chunk);
  return place = add_opened(
             number, stale == stale_.end() ? frames_of(graph_, chunk, cell->frames().get()) : std::move(stale->second));
}

std::optional<Search::At> Search::locate(FrameId frame) {
  const std::uint32_t chunk = tree_.find(storage::chunk_id(frame));
  std::uint32_t place = CellFrames::kNone;
  if (chunk != CellTree::kNone) {
    // The largest cell that is passed. A cell around one that is not passed is not passed, either.
    std::uint32_t cell = chunk, around = tree_.parent(cell);
    for (; around != within_ && is_passed(around); around = tree_.parent(cell)) cell = around;
    for (; around != within_; around = tree_.parent(around))
      if (around == tree_.root()) return std::nullopt;
    place = place_of(cell);
  } else if (const auto known = new_places_.find(storage::chunk_id(frame)); known != new_places_.end()) {
    place = known->second;
  } else if (const auto stale = stale_.find(storage::chunk_id(frame)); stale != stale_.end()) {
    place = new_places_[storage::chunk_id(frame)] = add_opened(CellTree::kNone, std::move(stale->second));
  } else {
    return std::nullopt;
  }
  const std::uint32_t node = places_[place].frames->find(frame);
  if (node == CellFrames::kNone) return std::nullopt;
  return At{place, node};
}

// Tries the hint first, which is right as a rule. Each part of the map has only one place, so if the cell of the hint
// is a place that holds the frame, it is the right one.
std::optional<Search::At> Search::end_of(const Link& link) {
  const At hint = At::unpack(link.met_at.get());
  if (hint.place < marks_.place.size())
    if (const std::uint32_t place = marks_.place[hint.place]; place != CellFrames::kNone) {
      const auto& nodes = places_[place].frames->nodes;
      if (hint.node < nodes.size() && nodes[hint.node] == link.to) return At{place, hint.node};
    }
  const auto end = locate(link.to);
  if (end && places_[end->place].number != CellTree::kNone)
    link.met_at.set(At{places_[end->place].number, end->node}.packed());
  return end;
}

// Updates the label of a node, and the best complete route. Returns whether the cost is the node's lowest so far.
bool Search::offer(Direction direction, At at, double cost, At from) {
  Place& place = places_[at.place];
  Labels& labels = place.labels[direction];
  if (!(cost < labels.cost[at.node])) return false;  // nor is what is no number
  labels.cost[at.node] = cost;
  labels.came[at.node] = from.packed();
  const double whole = cost + place.labels[1 - direction].cost[at.node];
  if (whole < best_) {
    best_ = whole;
    meeting_ = at;
  }
  return true;
}

void Search::walk_links(Direction direction, At at, double cost) {
  const CellFrames& cell = *places_[at.place].frames;
  for (const Link& link : cell.links_of(at.node)) {
    if (!(direction == kForward ? link.out : link.in) || is_refused(link)) continue;
    const auto end = end_of(link);
    if (!end || is_refused(places_[end->place], link.to)) continue;
    const double to_end = cost + weights_(link.costs()) * query_.penalty(cell.nodes[at.node], link.to);
    if (offer(direction, *end, to_end, at)) queues_[direction].push({to_end, *end});
  }
}

Status Search::begin(FrameId frame, Direction direction) {
  if (work_.proceed)
    if (Status status = work_.proceed(memory_bytes()); !status.ok()) return status;
  const auto at = locate(frame);
  if (!at) return no_such_frame(frame);
  if (!query_.filter.passes(frame)) return {};
  if (offer(direction, *at, 0, *at)) queues_[direction].push({0, *at});
  return {};
}

void Search::settle(Direction direction) {
  const Offer best = queues_[direction].top();
  queues_[direction].pop();
  if (best.at.node == kPending)
    leave(direction, best.at.place, best.cost);
  else
    enter(direction, best.at, best.cost);
}

// Enters a place at a node: passes it to all its other nodes, which then pend, and follows the node's links. The
// pending nodes are queued as one entry at the cost of the nearest: until that is due, most of them get their final
// costs.
void Search::enter(Direction direction, At at, double cost) {
  Place& place = places_[at.place];
  Labels& labels = place.labels[direction];
  if (cost > labels.cost[at.node] || labels.settled[at.node]) return;
  labels.settled[at.node] = true;
  ++settled_;
  if (place.passed) {
    auto& within = place.within[direction];
    if (!within && !place.passed->facts().oneway) within = place.within[1 - direction];
    if (!within) within = place.passed->within(query_.metric, direction == kBackward);
    const double before = labels.min_pending;
    const double* other = place.labels[1 - direction].cost.data();
    const double whole = relax_row(within->floors(at.node), within->rests(at.node), cost, at.packed(), other, labels);
    if (whole < best_) {
      best_ = whole;
      for (std::uint32_t node = 0; node < labels.cost.size(); ++node)
        if (labels.cost[node] + other[node] == whole) meeting_ = {at.place, node};
    }
    if (labels.min_pending < before) queues_[direction].push({labels.min_pending, {at.place, kPending}});
  }
  walk_links(direction, at, cost);
}

// Leaves a place: follows the links of its nearest pending nodes and of those that are not much further (kAhead).
void Search::leave(Direction direction, std::uint32_t number, double cost) {
  Labels& labels = places_[number].labels[direction];
  if (cost > labels.min_pending) return;
  take_pending(std::max(cost, cost * (1 + kAhead)), labels, due_);  // at least the nearest, whatever the costs are
  // Links are scattered in memory, so some are prefetched.
  constexpr std::size_t kNext = 4, kAfterNext = 8;
  const CellFrames& cell = *places_[number].frames;
  for (std::size_t i = 0; i < due_.size(); ++i) {
    if (i + kAfterNext < due_.size()) __builtin_prefetch(&cell.begin[due_[i + kAfterNext]]);
    if (i + kNext < due_.size()) __builtin_prefetch(&cell.links[cell.begin[due_[i + kNext]]]);
    walk_links(direction, {number, due_[i]}, labels.cost[due_[i]]);
  }
  if (labels.min_pending < kUnreachable) queues_[direction].push({labels.min_pending, {number, kPending}});
}

Result<std::optional<OverlayRoute>> Search::run(double enough) {
  for (std::size_t steps = 0;; ++steps) {
    const double forward = min_cost(kForward), backward = min_cost(kBackward);
    // Ends if the best route is proven, or if one side has searched all that it can reach.
    if (forward + backward >= best_ || forward == kUnreachable || backward == kUnreachable) break;
    if (best_ <= enough) break;
    if (forward + backward > query_.max_cost) return beyond(query_.max_cost, weights_);
    if (steps % kWorkStride == 0 && work_.proceed)
      if (Status status = work_.proceed(memory_bytes()); !status.ok()) return status;
    if (settled_ > work_.max_frames)
      return {Reason::OUT_OF_REACH, "no route found within the search's limit of " + std::to_string(work_.max_frames) +
                                        " frames at which cells are entered"};
    settle(forward <= backward ? kForward : kBackward);
  }
  if (best_ == kUnreachable) return std::optional<OverlayRoute>();
  if (best_ > query_.max_cost) return beyond(query_.max_cost, weights_);
  return std::optional(trace());
}

// Appends the hops from the meeting point back to where the search in this direction began.
void Search::trace(Direction direction, std::vector<Hop>& hops, FrameId& end) const {
  for (At at = meeting_;;) {
    const Place& place = places_[at.place];
    const Labels& labels = place.labels[direction];
    end = place.frames->nodes[at.node];
    const At before = At::unpack(labels.came[at.node]);
    if (before.packed() == at.packed()) return;
    const CellFrames& of_before = *places_[before.place].frames;
    Hop hop{of_before.nodes[before.node], end, place.number, {}, false, 0};
    if (before.place == at.place && place.passed) {
      hop.cost = (*place.within[direction])(before.node, at.node);
    } else {
      hop.cell = CellTree::kNone;
      const Link* cheapest = nullptr;
      for (const Link& link : of_before.links_of(before.node))
        if (link.to == end && (direction == kForward ? link.out : link.in) && !is_refused(link) &&
            (!cheapest || weights_(link.costs()) < weights_(cheapest->costs())))
          cheapest = &link;
      hop.edge = cheapest->edge(hop.from);
      hop.cost = weights_(cheapest->costs());
      hop.forward = cheapest->forward == (direction == kForward);
    }
    if (direction == kBackward) std::swap(hop.from, hop.to);
    hops.push_back(hop);
    at = before;
  }
}

OverlayRoute Search::trace() const {
  OverlayRoute route;
  route.cost = best_;
  trace(kForward, route.hops, route.from);
  std::reverse(route.hops.begin(), route.hops.end());
  trace(kBackward, route.hops, route.to);
  route.nodes_settled = settled_;
  route.chunks_opened = chunks_opened_;
  return route;
}

}  // namespace

std::optional<std::vector<std::uint32_t>> cells_to_open(const Overlay& overlay, const RouteFilter& filter) {
  if (filter.supposed.candidates || filter.supposed.quarantined) return std::nullopt;
  const CellTree& tree = overlay.tree();
  const std::size_t max_cells = std::max<std::size_t>(10, tree.chunks() / 10);
  std::vector<std::uint32_t> cells;
  if (!filter.sessions.empty())
    for (const SessionNumber session : tree.sessions())
      if (!filter.sessions.contains(session) && cells.size() <= max_cells) {
        const auto refused = tree.chunks_of(session);
        cells.insert(cells.end(), refused.begin(), refused.end());
      }
  for (const FrameId frame : filter.avoided)
    if (const std::uint32_t chunk = tree.find(storage::chunk_id(frame)); chunk != CellTree::kNone)
      cells.push_back(chunk);
  if ((filter.min_support > 0 || !filter.long_loops) && tree.chunks() > 0) {
    std::vector<std::uint32_t> open{tree.root()};
    while (!open.empty() && cells.size() <= max_cells) {
      const std::uint32_t number = open.back();
      open.pop_back();
      const StoredCell* cell = overlay.cell(number);
      if (cell && cell->facts().min_support >= filter.min_support &&
          (filter.long_loops || cell->facts().max_loop_m <= kLongLoopMetres))
        continue;
      if (cell) cells.push_back(number);  // the refused edge may be in a part of it or between two parts
      const auto& children = tree.node(number).children;
      open.insert(open.end(), children.begin(), children.end());
    }
  }
  if (cells.size() > max_cells) return std::nullopt;
  return cells;
}

namespace {

// nullopt if there is no route.
Result<std::optional<OverlayRoute>> search_cells(const Overlay& overlay, const storage::Graph& graph,
                                                 const OverlayQuery& query, std::span<const FrameId> from,
                                                 std::span<const FrameId> to, const WorkLimit& work) {
  Marks marks(overlay.tree());
  Search search(overlay, graph, query, overlay.tree().root(), marks, work);
  search.open_stale(query.stale);
  for (const std::uint32_t cell : query.opened) search.open_around(cell);
  if (query.penalty.frames)  // the costs of passing a cell are without it
    for (const auto& [chunk, frames] : query.penalty.frames->chunks()) search.open_around(overlay.tree().find(chunk));
  for (const auto& ends : {from, to})
    for (const FrameId frame : ends) search.open_around(overlay.tree().find(storage::chunk_id(frame)));
  for (const FrameId frame : from)
    if (Status status = search.begin(frame, kForward); !status.ok()) return status;
  for (const FrameId frame : to)
    if (Status status = search.begin(frame, kBackward); !status.ok()) return status;
  for (const Direction direction : {kForward, kBackward})
    if (!search.has_begun(direction)) return end_refused(direction == kForward);
  return search.run();
}

}  // namespace

Result<OverlayRoute> find_route(const Overlay& overlay, const storage::Graph& graph, const OverlayQuery& query,
                                std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work) {
  if (Status status = check_ends(from, to); !status.ok()) return status;
  auto route = search_cells(overlay, graph, query, from, to, work);
  if (!route.ok()) return route.status();
  if (*route) return **std::move(route);
  const bool filtered = !query.filter.refuses_nothing();
  try {
    const Reachability joined(overlay, graph, query.stale, from, to, work);
    return not_connected(graph, joined.sessions(), to, joined.goal() && !filtered, filtered);
  } catch (const StatusError& error) {
    return Status(Reason::NOT_CONNECTED,
                  "no route leads there; what is connected cannot be determined: " + error.status().message());
  }
}

Status unpack(const Overlay& overlay, const storage::Graph& graph, std::size_t metric, OverlayRoute& route,
              const WorkLimit& work) {
  Marks marks(overlay.tree());
  OverlayQuery query;  // without stale chunks and filter, neither of which concerns a cell that was passed
  query.metric = metric;
  std::vector<Hop> packed(route.hops.rbegin(), route.hops.rend()), unpacked;
  while (!packed.empty()) {
    const Hop hop = packed.back();
    packed.pop_back();
    if (hop.cell == CellTree::kNone || overlay.tree().node(hop.cell).level == 0) {
      unpacked.push_back(hop);
      continue;
    }
    Search search(overlay, graph, query, hop.cell, marks, work);
    if (Status status = search.begin(hop.from, kForward); !status.ok()) return status;
    if (Status status = search.begin(hop.to, kBackward); !status.ok()) return status;
    auto inside = search.run(hop.cost * (1 + SplitCostMatrix::kPrecision));
    if (!inside.ok()) return inside.status();
    if (!*inside) return {Reason::INTERNAL, "a cell that was passed has no path through it"};
    packed.insert(packed.end(), (*inside)->hops.rbegin(), (*inside)->hops.rend());
  }
  route.hops = std::move(unpacked);
  return {};
}

}  // namespace relmap::route
