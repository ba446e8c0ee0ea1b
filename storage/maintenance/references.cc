#include "storage/maintenance/references.h"

#include <algorithm>

#include "storage/graph/binding.h"

namespace relmap::storage {
namespace {

std::uint64_t drawn(std::uint64_t a, std::uint64_t b) {
  return detail::mix(detail::mix(a) + 0x9e3779b97f4a7c15ULL * b);
}
std::uint64_t drawn(EdgeId edge) { return drawn(edge.frame.packed(), edge.ordinal); }
std::uint64_t drawn(EdgeId edge, FrameId end) { return drawn(drawn(edge), end.packed()); }
std::uint64_t drawn(LandmarkId landmark, FrameId observer) {
  return drawn(drawn(landmark.base.packed(), landmark.slot), observer.packed());
}
std::uint64_t drawn(EdgeId from, EdgeId to) { return drawn(drawn(from), drawn(to)); }

void add(ChunkTable& table, Derived kind, FrameId owner, std::uint64_t number) {
  if (ChunkEntry* entry = table.find(chunk_id(owner))) entry->sum(kind) += number;
}

bool has_gone(const StoredGraph& graph, FrameId frame) {
  const auto session = graph.session(frame.session);
  return session && is_removed(*session, frame);
}

// Counts complaints of one kind instead of listing them: a lost frame then causes one line for each frame that refers
// to it.
class Tally {
 public:
  void note(const std::string& example) {
    if (count_++ == 0) example_ = example;
  }
  void tell(const std::string& what, const Complain& complain) const {
    if (count_ > 0) complain(std::to_string(count_) + " " + what + (count_ > 1 ? ", the first " : ": ") + example_);
  }

 private:
  std::size_t count_ = 0;
  std::string example_;
};

bool is_closure(const Graph& graph, EdgeId id) {
  const auto hot = graph.hot(id.frame);
  const Edge* edge = hot ? hot->edge(id) : nullptr;
  return edge && edge->kind == EdgeKind::kLoop;
}

void add_edge(ChunkTable& table, const StoredGraph& graph, FrameId id, const FrameHot& frame, const Edge& edge,
              const Complain& complain) {
  const std::string name = "edge " + edge.id.to_string();
  // A closure whose other end was lost stays, quarantined, for its evidence.
  const bool of_lost = edge.state == EdgeState::kQuarantined && edge.reason == Reason::DATA_LOSS;
  if (const auto a = graph.hot(edge.a)) {
    if (taken_in(*a) >= taken_in(frame)) complain(name + ": its first end is the newer one");
  } else if (!of_lost) {
    complain(name + ": its end " + edge.a.to_string() + " is not there");
  }
  add(table, Derived::kIncoming, edge.a, drawn(edge.id, edge.a));
  if (edge.in_graph() && edge.prior_active != needs_prior(edge, edge.support))
    complain(name + (edge.prior_active ? ": its prior is active" : ": its prior is not active") + ", with support " +
             std::to_string(edge.support));
  add(table, Derived::kSupport, id, -(edge.support * drawn(edge.id)));
  add(table, Derived::kBound, id, -(edge.bound * drawn(edge.id)));
  Tally lost;
  for (const FrameId bound : edge.bound_frames)
    if (!table.has(bound) && !has_gone(graph, bound)) lost.note(bound.to_string());
  lost.tell("frames that " + name + " binds are not there", complain);
  Tally strangers;
  for (const EdgeId other : edge.consistent_with) {
    if (!is_closure(graph, other)) strangers.note(other.to_string());
    add(table, Derived::kConsistent, id, drawn(edge.id, other));
    add(table, Derived::kConsistent, other.frame, -drawn(other, edge.id));
  }
  strangers.tell("closures consistent with " + name + " are not there", complain);
  for_each_carried_step(edge, [&](EdgeId step) {
    if (table.has(step.frame)) add(table, Derived::kCarriedBy, step.frame, drawn(step, edge.id));
  });
  for (const EdgeId carrier : edge.carried_by) add(table, Derived::kCarriedBy, id, -drawn(edge.id, carrier));
  if (!std::is_sorted(edge.carried_by.begin(), edge.carried_by.end()))
    complain(name + ": the closures that carry it are not sorted");
}

// Whether the stored list of a landmark's observers should have this one: always if the list is not full, otherwise if
// this one was taken in no later than the list's last one.
bool belongs_to_first(const Graph& graph, LandmarkId landmark, FrameId observer) {
  const auto base = graph.hot(landmark.base);
  if (landmark.slot >= base->landmarks.size()) return true;
  const auto& list = base->landmarks[landmark.slot].observers;
  if (!is_fixed(list)) return true;
  const auto last = graph.hot(list.back()), own = graph.hot(observer);
  return !last || !own || taken_in(*own) <= taken_in(*last);
}

// A reference to a deleted session by a closure that was not in force is void, and no damage.
void note_lost(const StoredGraph& graph, LandmarkId landmark, Tally& lost) {
  if (!has_gone(graph, landmark.base)) lost.note(landmark.to_string());
}

}  // namespace

void SightedPaths::visit(FrameId frame, const FrameWarm& warm, const Visit& visit) {
  constexpr std::size_t kMaxFrames = 256;  // kept from one frame to the next
  if (local_.frames.size() > kMaxFrames) local_.clear();
  std::vector<LandmarkId> not_needed;
  for (const LandmarkId landmark : landmarks_seen(local_.graph(), warm, &not_needed)) {
    const bool reached = local_.path(local_.frame(landmark.base), local_.frame(frame), &steps_);
    edges_.clear();
    for (const LocalStep& step : steps_) edges_.push_back(local_.edges[static_cast<std::size_t>(step.edge)].id);
    visit(landmark, reached ? &edges_ : nullptr);
  }
  for (const LandmarkId landmark : not_needed) visit(landmark, nullptr);
}

void add_hot_references(const StoredGraph& graph, ChunkTable& table, FrameId id, const FrameHot& frame,
                        const Complain& complain) {
  for (const Edge& edge : frame.edges) add_edge(table, graph, id, frame, edge, complain);
  if (!std::is_sorted(frame.incoming.begin(), frame.incoming.end())) complain("its incoming edges are not sorted");
  for (const EdgeId edge : frame.incoming) add(table, Derived::kIncoming, id, -drawn(edge, id));

  if (!std::is_sorted(frame.unreached.begin(), frame.unreached.end()))
    complain("its unreached observers are not sorted");
  for (const Unreached& item : frame.unreached)
    add(table, Derived::kUnreached, id, -drawn(LandmarkId{id, item.slot}, item.observer));
  Tally lost_targets, lost_closures, younger;
  for (std::uint32_t slot = 0; slot < frame.landmarks.size(); ++slot) {
    const Landmark& landmark = frame.landmarks[slot];
    const LandmarkId self{id, slot};
    for (const AliasClaim& claim : landmark.claims) {
      if (claim.target.valid()) {  // otherwise it says that the landmark is not needed
        const auto target = graph.hot(claim.target.base);
        if (!target || claim.target.slot >= target->landmarks.size())
          note_lost(graph, claim.target, lost_targets);
        else if (taken_in(*target) >= taken_in(frame))
          younger.note(self.to_string());
      }
      if (!claim.closure.valid()) continue;
      if (!is_closure(graph, claim.closure)) lost_closures.note(claim.closure.to_string());
      add(table, Derived::kBound, claim.closure.frame, drawn(claim.closure));
    }
    std::vector<FrameId> ordered = landmark.observers;
    keep_first_observers(graph, &ordered);
    if (ordered != landmark.observers) add(table, Derived::kObservers, id, drawn(self, self.base) ^ 1);
    for (const FrameId observer : landmark.observers) add(table, Derived::kObservers, id, -drawn(self, observer));
  }
  lost_targets.tell("claims are to landmarks that are not there", complain);
  lost_closures.tell("claims are by closures that are not there", complain);
  younger.tell("claims are to a landmark that is not older", complain);
}

void add_observations(const StoredGraph& graph, ChunkTable& table, SightedPaths& paths, FrameId id,
                      const FrameWarm& frame, const Complain& complain) {
  Tally lost_landmarks, lost_closures, unbound;
  for (const Observation& z : frame.observations) {
    const auto base = graph.hot(z.landmark.base);
    if (!base || z.landmark.slot >= base->landmarks.size()) note_lost(graph, z.landmark, lost_landmarks);
    if (!z.origin.valid()) continue;
    add(table, Derived::kBound, z.origin.frame, drawn(z.origin));
    const auto closure_hot = graph.hot(z.origin.frame);
    const Edge* closure = closure_hot ? closure_hot->edge(z.origin) : nullptr;
    if (!closure || closure->kind != EdgeKind::kLoop)
      lost_closures.note(z.origin.to_string());
    else if (!std::binary_search(closure->bound_frames.begin(), closure->bound_frames.end(), id))
      unbound.note(z.origin.to_string());
  }
  lost_landmarks.tell("observations are of landmarks that are not there", complain);
  lost_closures.tell("observations are by closures that are not there", complain);
  unbound.tell("observations are by closures that do not name the frame", complain);
  paths.visit(id, frame, [&](LandmarkId landmark, const std::vector<EdgeId>* path) {
    if (!path) return add(table, Derived::kUnreached, landmark.base, drawn(landmark, id));
    for (const EdgeId edge : *path) add(table, Derived::kSupport, edge.frame, drawn(edge));
    if (belongs_to_first(graph, landmark, id)) add(table, Derived::kObservers, landmark.base, drawn(landmark, id));
  });
}

}  // namespace relmap::storage
