#include <algorithm>
#include <deque>
#include <queue>

#include "server/route/overlay/labels.h"
#include "server/route/overlay/overlay.h"

namespace relmap {
namespace {

// How much further than the nearest nodes of a place those may be that are left together with it: a share of the way.
constexpr double kAhead = 0.2;

enum Way : std::uint8_t { kForward = 0, kBackward = 1 };  // from the start, and from the goal against the traffic

// Of all cells, for one search after another.
struct Marks {
  explicit Marks(const CellTree& tree) : place(tree.size(), Cell::kNone), opened(tree.size()) {}
  std::vector<std::uint32_t> place;
  std::vector<bool> opened;
};

// From both ends at once (Pohl 1971), over the cells and frames within one cell, or within the whole map.
class Search {
 public:
  Search(const Overlay& overlay, const Graph& graph, std::size_t metric, std::uint32_t within, Marks& marks,
         const WorkLimit& work)
      : overlay_(overlay),
        tree_(overlay.tree()),
        graph_(graph),
        metric_(metric),
        weights_(overlay.metrics()[metric]),
        within_(within),
        marks_(marks),
        work_(work) {}
  ~Search() {
    for (const Place& place : places_) marks_.place[place.number] = Cell::kNone;
    for (const std::uint32_t cell : opened_) marks_.opened[cell] = false;
  }
  Search(const Search&) = delete;
  Search& operator=(const Search&) = delete;

  // Cells around the frame are not passed: their parts are looked at, down to the frames of its chunk.
  void open_around(FrameId frame) {
    for (std::uint32_t cell = tree_.find(chunk_id(frame)); cell != CellTree::kNone && cell != within_;
         cell = tree_.node(cell).parent) {
      marks_.opened[cell] = true;
      opened_.push_back(cell);
    }
  }
  Status begin(FrameId frame, Way way);
  Result<OverlayRoute> run();

 private:
  // A part of the map as this search sees it.
  struct Place {
    std::uint32_t number;  // in the tree
    Cell frames;           // of an opened chunk
    const Cell* cell;
    Labels labels[2];                 // they come from a place and a node, packed: from the same place by passing it
    std::vector<std::uint64_t> ends;  // where its links lead, packed; kUnknown: not looked for, kNowhere: outside
  };
  static constexpr std::uint64_t kUnknown = ~std::uint64_t{0}, kNowhere = kUnknown - 1;
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
    At at;  // a node at which a cell is entered; or kPending: those to which a place was passed
    bool operator>(const Offer& other) const {
      return cost != other.cost ? cost > other.cost : at.packed() > other.at.packed();
    }
  };
  using Queue = std::priority_queue<Offer, std::vector<Offer>, std::greater<>>;

  bool is_passed(std::uint32_t cell) const { return !marks_.opened[cell] && overlay_.cell(cell); }
  // Where a frame is met; nullopt: nowhere within.
  std::optional<At> locate(FrameId frame);
  std::uint32_t place_of(std::uint32_t number);
  bool offer(Way way, At at, double cost, At from);
  void walk_links(Way way, At at, double cost);
  void settle(Way way);
  void enter(Way way, At at, double cost);
  void leave(Way way, std::uint32_t place, double cost);
  double least(Way way) const { return queues_[way].empty() ? kUnreachable : queues_[way].top().cost; }
  std::size_t memory_bytes() const {
    return marks_.place.size() * sizeof(marks_.place[0]) + place_bytes_ +
           (queues_[kForward].size() + queues_[kBackward].size()) * sizeof(Offer);
  }
  OverlayRoute trace() const;
  void trace(Way way, std::vector<Hop>& hops, FrameId& end) const;

  const Overlay& overlay_;
  const CellTree& tree_;
  const Graph& graph_;
  const std::size_t metric_;
  const RouteWeights weights_;
  const std::uint32_t within_;
  Marks& marks_;
  const WorkLimit& work_;
  std::vector<std::uint32_t> opened_;
  std::deque<Place> places_;
  Queue queues_[2];
  std::vector<std::uint32_t> due_;
  double best_ = kUnreachable;  // of a whole route
  At meeting_{};
  std::uint64_t settled_ = 0;
  std::size_t place_bytes_ = 0;
  std::uint32_t chunks_opened_ = 0;
};

std::uint32_t Search::place_of(std::uint32_t number) {
  if (marks_.place[number] != Cell::kNone) return marks_.place[number];
  const bool pass = is_passed(number);
  const auto entered = marks_.place[number] = static_cast<std::uint32_t>(places_.size());
  Cell frames = pass ? Cell{} : frames_of(graph_, tree_.node(number).chunk, overlay_.cell(number));
  const std::size_t nodes = pass ? overlay_.cell(number)->nodes.size() : frames.nodes.size();
  Place& place = places_.emplace_back(Place{number, std::move(frames), nullptr, {Labels(nodes), Labels(nodes)}, {}});
  place.cell = pass ? overlay_.cell(number) : &place.frames;
  place.ends.assign(place.cell->links.size(), kUnknown);
  chunks_opened_ += !pass;
  place_bytes_ += sizeof place + nodes * 50 + place.ends.size() * 8 + (pass ? 0 : place.frames.memory_bytes());
  return entered;
}

std::optional<Search::At> Search::locate(FrameId frame) {
  const std::uint32_t chunk = tree_.find(chunk_id(frame));
  if (chunk == CellTree::kNone) return std::nullopt;
  const auto path = tree_.path(chunk);
  std::uint32_t level = tree_.node(within_).level;
  if (level < path.size() && path[level] != within_) return std::nullopt;
  // The largest cell that is passed: those above one that is opened are opened, too.
  while (level-- > 1)
    if (is_passed(path[level])) break;
  const std::uint32_t place = place_of(path[level]);
  const std::uint32_t node = places_[place].cell->find(frame);
  if (node == Cell::kNone) return std::nullopt;
  return At{place, node};
}

// Whether it is the best so far.
bool Search::offer(Way way, At at, double cost, At from) {
  Place& place = places_[at.place];
  Labels& labels = place.labels[way];
  if (cost >= labels.cost[at.node]) return false;
  labels.cost[at.node] = cost;
  labels.came[at.node] = from.packed();
  const double whole = cost + place.labels[1 - way].cost[at.node];
  if (whole < best_) {
    best_ = whole;
    meeting_ = at;
  }
  return true;
}

void Search::walk_links(Way way, At at, double cost) {
  Place& place = places_[at.place];
  const Cell& cell = *place.cell;
  for (std::uint32_t i = cell.begin[at.node]; i < cell.begin[at.node + 1]; ++i) {
    const Link& link = cell.links[i];
    if (!(way == kForward ? link.out : link.in) || place.ends[i] == kNowhere) continue;
    if (place.ends[i] == kUnknown) {
      const auto end = locate(link.to);
      place.ends[i] = end ? end->packed() : kNowhere;
      if (!end) continue;
    }
    const At end = At::unpack(place.ends[i]);
    const double to_end = cost + weights_(link.costs);
    if (offer(way, end, to_end, at)) queues_[way].push({to_end, end});
  }
}

Status Search::begin(FrameId frame, Way way) {
  if (work_.proceed)
    if (Status status = work_.proceed(memory_bytes()); !status.ok()) return status;
  const auto at = locate(frame);
  if (!at) return {Reason::NO_SUCH_FRAME, "no frame " + frame.to_string()};
  if (offer(way, *at, 0, *at)) queues_[way].push({0, *at});
  return {};
}

void Search::settle(Way way) {
  const Offer best = queues_[way].top();
  queues_[way].pop();
  if (best.at.node == kPending)
    leave(way, best.at.place, best.cost);
  else
    enter(way, best.at, best.cost);
}

// To all other nodes of the place. There the search is queued as one, and goes on when it comes to the nearest: by then
// most of them have been reached in the best way.
void Search::enter(Way way, At at, double cost) {
  Place& place = places_[at.place];
  Labels& labels = place.labels[way];
  if (cost > labels.cost[at.node] || labels.settled[at.node]) return;
  labels.settled[at.node] = true;
  ++settled_;
  if (!place.cell->within.empty()) {
    const double before = labels.least_pending;
    const double* other = place.labels[1 - way].cost.data();
    const double whole =
        relax_row(place.cell->passages(metric_, at.node, way == kBackward), cost, at.packed(), other, labels);
    if (whole < best_) {
      best_ = whole;
      for (std::uint32_t node = 0; node < labels.cost.size(); ++node)
        if (labels.cost[node] + other[node] == whole) meeting_ = {at.place, node};
    }
    if (labels.least_pending < before) queues_[way].push({labels.least_pending, {at.place, kPending}});
  }
  walk_links(way, at, cost);
}

// Over the links of the nearest nodes that the place was passed to, and of those not much further.
void Search::leave(Way way, std::uint32_t number, double cost) {
  Labels& labels = places_[number].labels[way];
  if (cost > labels.least_pending) return;
  take_pending(cost * (1 + kAhead), labels, due_);
  for (const std::uint32_t node : due_) walk_links(way, {number, node}, labels.cost[node]);
  if (labels.least_pending < kUnreachable) queues_[way].push({labels.least_pending, {number, kPending}});
}

Result<OverlayRoute> Search::run() {
  for (std::size_t steps = 0;; ++steps) {
    const double forward = least(kForward), backward = least(kBackward);
    // One side has seen all that it can reach: it has seen the other's end, or no way leads there.
    if (forward + backward >= best_ || forward == kUnreachable || backward == kUnreachable) break;
    if (steps % kWorkStride == 0 && work_.proceed)
      if (Status status = work_.proceed(memory_bytes()); !status.ok()) return status;
    if (settled_ > work_.max_frames)
      return {Reason::OUT_OF_REACH, "no route found within the search's limit of " + std::to_string(work_.max_frames) +
                                        " frames at which cells are entered"};
    settle(forward <= backward ? kForward : kBackward);
  }
  if (best_ == kUnreachable) return {Reason::NOT_CONNECTED, "no way leads there"};
  return trace();
}

// From the meeting to the end where the search began, hops against it.
void Search::trace(Way way, std::vector<Hop>& hops, FrameId& end) const {
  for (At at = meeting_;;) {
    const Place& place = places_[at.place];
    const Labels& labels = place.labels[way];
    end = place.cell->nodes[at.node];
    const At before = At::unpack(labels.came[at.node]);
    if (before.packed() == at.packed()) return;
    const Cell& of_before = *places_[before.place].cell;
    Hop hop{of_before.nodes[before.node], end, place.number, {}, false};
    if (before.place != at.place || place.cell->within.empty()) {
      hop.cell = CellTree::kNone;
      const Link* cheapest = nullptr;
      for (const Link& link : of_before.links_of(before.node))
        if (link.to == end && (way == kForward ? link.out : link.in) &&
            (!cheapest || weights_(link.costs) < weights_(cheapest->costs)))
          cheapest = &link;
      hop.edge = cheapest->edge;
      hop.forward = cheapest->forward == (way == kForward);
    }
    if (way == kBackward) std::swap(hop.from, hop.to);
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
  route.cells_entered = static_cast<std::uint32_t>(places_.size());
  route.chunks_opened = chunks_opened_;
  return route;
}

}  // namespace

Result<OverlayRoute> find_route(const Overlay& overlay, const Graph& graph, std::size_t metric,
                                std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work) {
  Marks marks(overlay.tree());
  Search search(overlay, graph, metric, overlay.tree().root(), marks, work);
  for (const auto& ends : {from, to})
    for (const FrameId frame : ends) search.open_around(frame);
  for (const FrameId frame : from)
    if (Status status = search.begin(frame, kForward); !status.ok()) return status;
  for (const FrameId frame : to)
    if (Status status = search.begin(frame, kBackward); !status.ok()) return status;
  return search.run();
}

Status unpack(const Overlay& overlay, const Graph& graph, std::size_t metric, OverlayRoute& route,
              const WorkLimit& work) {
  Marks marks(overlay.tree());
  std::vector<Hop> packed(route.hops.rbegin(), route.hops.rend()), unpacked;
  while (!packed.empty()) {
    const Hop hop = packed.back();
    packed.pop_back();
    if (hop.cell == CellTree::kNone || overlay.tree().node(hop.cell).level == 0) {
      unpacked.push_back(hop);
      continue;
    }
    Search search(overlay, graph, metric, hop.cell, marks, work);
    if (Status status = search.begin(hop.from, kForward); !status.ok()) return status;
    if (Status status = search.begin(hop.to, kBackward); !status.ok()) return status;
    auto inside = search.run();
    if (!inside.ok()) return inside.status();
    packed.insert(packed.end(), inside->hops.rbegin(), inside->hops.rend());
  }
  route.hops = std::move(unpacked);
  return {};
}

}  // namespace relmap
