#include "server/route/alternatives.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <optional>
#include <utility>

#include "server/route/beside.h"
#include "storage/graph/frame_set.h"

namespace relmap::route {

namespace {

// A route that was found, with what is needed to compare it with others.
struct Candidate {
  Route route;
  std::vector<FrameId> frames;
  std::vector<double> metres, costs;  // of the edge from each frame to the next
  storage::FrameSet own;              // its frames
  storage::FrameSet beside;           // and those beside it

  std::size_t memory_bytes() const {
    return route.path.memory_bytes() + frames.capacity() * sizeof(FrameId) +
           (metres.capacity() + costs.capacity()) * sizeof(double) + own.memory_bytes() + beside.memory_bytes();
  }
};

void add(const storage::FrameSet& more, storage::FrameSet& frames) {
  for (const auto& [chunk, mask] : more.chunks()) frames.set_chunk(chunk, frames.chunk(chunk) | mask);
}

constexpr int kAlongside = storage::kFramesPerChunk / 4;  // frames of a chunk

class Finder {
 public:
  Finder(const storage::Graph& graph, const Route& cheapest, const AlternativesQuery& query,
         const PenalisedSearch& search, const WorkLimit& work)
      : graph_(graph), cheapest_(cheapest), query_(query), search_(search), work_(work) {
    work_.proceed = [this, &work](std::size_t bytes) { return work.proceed ? work.proceed(bytes + held_) : Status(); };
  }

  void run() {
    if (!(cheapest_.cost > 0 && cheapest_.distance_m > 0)) return;
    first_ = examine(cheapest_);
    if (!first_) return;
    hold(*first_);
    // Some searches find what is no alternative, but whose ways are dearer for the next.
    for (std::size_t searches = 2 * query_.count + 3; searches > 0 && chosen_.size() < query_.count; --searches) {
      auto route = search_(query_.from, query_.to, {&known_, kMaxStretch}, rest());
      if (!route.ok()) return;
      count(*route);
      auto found = examine(std::move(route).value());
      if (!found) return;
      const std::size_t known_before = known_.size();
      auto improved = put_back(*found);
      hold(*found);
      if (known_.size() == known_before) return;  // the next search would find the same
      if (improved) {
        hold(*improved);
        found = std::move(improved);
      }
      candidates_.push_back(*std::move(found));
      choose();
    }
  }

  std::vector<Alternative> take() {
    std::vector<Alternative> taken;
    for (const Choice& choice : chosen_)
      taken.push_back({std::move(candidates_[choice.candidate].route), choice.shared});
    return taken;
  }

 private:
  // What is left of the work.
  WorkLimit rest() const {
    WorkLimit rest = work_;
    rest.max_frames -= std::min(rest.max_frames, touched_);
    return rest;
  }
  void count(const Route& route) { touched_ += route.frames_touched; }
  // From now on its ways are known, and dearer, and so is what lies beside it, except where that is only the beginnings
  // of ways that branch off: a search by cells would have to open a chunk for each of these.
  void hold(const Candidate& candidate) {
    add(candidate.own, known_);
    for (const auto& [chunk, mask] : candidate.beside.chunks())
      if (std::popcount(mask) >= kAlongside) known_.set_chunk(chunk, known_.chunk(chunk) | mask);
    held_ += candidate.memory_bytes() + candidate.beside.memory_bytes();
  }

  // nullopt if it passes a frame twice, or the work ends.
  std::optional<Candidate> examine(Route route) {
    Candidate candidate;
    storage::FrameSet& own = candidate.own;
    {
      PathWalk walk(graph_, route.path);
      while (const auto step = walk.next()) {
        if (own.size() % kWorkStride == 0 && !work_.proceed(own.memory_bytes() + candidate.memory_bytes()).ok())
          return std::nullopt;
        if (own.contains(step->frame)) return std::nullopt;
        own.insert(step->frame);
        candidate.frames.push_back(step->frame);
        if (!step->edge) continue;
        candidate.metres.push_back(length_m(**step->edge));
        candidate.costs.push_back(query_.weights(**step->edge));
      }
    }
    auto beside =
        frames_beside(graph_, candidate.frames, std::min(kBesideMetres, kBesideShare * cheapest_.distance_m), rest());
    if (!beside.ok()) return std::nullopt;
    touched_ += beside->size();
    candidate.beside = std::move(beside).value();
    candidate.route = std::move(route);
    return candidate;
  }

  // Short parts that leave the known ways without being the cheapest between their ends are replaced by those that are.
  // nullopt if there are none.
  std::optional<Candidate> put_back(const Candidate& found) {
    constexpr std::size_t kMaxParts = 16;
    const std::vector<std::uint16_t> turns(found.route.path.turns.rbegin(), found.route.path.turns.rend());
    std::vector<std::uint16_t> better;
    bool changed = false;
    std::size_t parts = 0;
    for (std::size_t begin = 0; begin < turns.size();) {
      const auto is_known = [&](std::size_t step) {
        return known_.contains(found.frames[step]) && known_.contains(found.frames[step + 1]);
      };
      std::size_t end = begin + 1;
      while (end < turns.size() && is_known(end) == is_known(begin)) ++end;
      const auto [first, last] = std::pair(static_cast<std::ptrdiff_t>(begin), static_cast<std::ptrdiff_t>(end));
      const double cost = std::accumulate(found.costs.begin() + first, found.costs.begin() + last, 0.0);
      std::optional<Route> cheaper;
      if (!is_known(begin) && cost < kLocalShare * cheapest_.cost && parts++ < kMaxParts)
        cheaper = cheaper_between(found.frames[begin], found.frames[end], cost, found.route.path.supposed);
      if (cheaper) {
        changed = true;
        better.insert(better.end(), cheaper->path.turns.rbegin(), cheaper->path.turns.rend());
      } else {
        better.insert(better.end(), turns.begin() + first, turns.begin() + last);
      }
      begin = end;
    }
    if (!changed) return std::nullopt;
    Route route;
    route.path = found.route.path;
    route.path.turns.assign(better.rbegin(), better.rend());
    route.frames_touched = found.route.frames_touched;
    route.count_standing = found.route.count_standing;
    PathWalk walk(graph_, route.path);
    while (const auto step = walk.next())
      if (step->edge) route.count(**step->edge, query_.weights(**step->edge));
    return examine(std::move(route));
  }

  std::optional<Route> cheaper_between(FrameId from, FrameId to, double cost, storage::Supposed supposed) {
    auto route = search_({&from, 1}, {&to, 1}, {}, rest());
    if (!route.ok()) return std::nullopt;
    count(*route);
    constexpr double kPrecision = 1e-9;  // of searches by cells
    if (!(route->cost < cost * (1 - kPrecision)) || route->path.supposed.bound != supposed.bound) return std::nullopt;
    return std::move(route).value();
  }

  double shared(const Candidate& candidate, const storage::FrameSet& before) const {
    double all = 0, on_these = 0;
    for (std::size_t i = 0; i < candidate.metres.size(); ++i) {
      all += candidate.metres[i];
      if (before.contains(candidate.frames[i]) && before.contains(candidate.frames[i + 1]))
        on_these += candidate.metres[i];
    }
    return all > 0 ? on_these / all : 1;
  }

  // Chooses anew among the candidates, by cost, since the cheaper one of two that are much alike comes before.
  void choose() {
    std::vector<std::size_t> order(candidates_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) {
      return candidates_[x].route.cost < candidates_[y].route.cost;
    });
    std::vector<Choice> chosen;
    storage::FrameSet before = first_->beside;
    for (const std::size_t i : order) {
      const Candidate& candidate = candidates_[i];
      if (candidate.route.cost > std::min(kMaxStretch * cheapest_.cost, query_.max_cost)) break;
      const double share = shared(candidate, before);
      if (share > kMaxShared) continue;
      chosen.push_back({i, share});
      if (chosen.size() == query_.count) break;
      add(candidate.beside, before);
    }
    if (chosen.size() >= chosen_.size()) chosen_ = std::move(chosen);
  }

  struct Choice {
    std::size_t candidate;
    double shared;
  };

  const storage::Graph& graph_;
  const Route& cheapest_;
  const AlternativesQuery& query_;
  const PenalisedSearch& search_;
  WorkLimit work_;
  std::size_t touched_ = 0, held_ = 0;
  std::optional<Candidate> first_;
  std::vector<Candidate> candidates_;  // in the order in which they were found
  std::vector<Choice> chosen_;
  storage::FrameSet known_;  // on and beside all routes that were found; these are dearer
};

}  // namespace

std::vector<Alternative> find_alternatives(const storage::Graph& graph, const Route& cheapest,
                                           const AlternativesQuery& query, const PenalisedSearch& search,
                                           const WorkLimit& work) {
  Finder finder(graph, cheapest, query, search, work);
  try {
    finder.run();
  } catch (const StatusError&) {  // what cannot be read may not be on the routes that were found
  }
  return finder.take();
}

}  // namespace relmap::route
