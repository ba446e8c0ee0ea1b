#include "storage/maintenance/recount.h"

#include <algorithm>
#include <map>
#include <span>

#include "storage/maintenance/references.h"

namespace relmap::storage {
namespace {

// First guess of the bytes that the items of one chunk take. If they take more, fewer chunks are taken at a time.
constexpr std::size_t kChunkBytes = std::size_t{128} << 10;
constexpr std::size_t kNodeBytes = 64;  // of a map's node, with its key

struct TooMuch {};

// The derived items of some chunks, as they follow from the facts.
class Expected {
 public:
  // `chunks`: ascending.
  Expected(std::span<const ChunkId> chunks, std::size_t limit) : chunks_(chunks), limit_(limit) {}

  bool wants(FrameId owner) const { return std::binary_search(chunks_.begin(), chunks_.end(), chunk_id(owner)); }
  template <typename Map, typename Key, typename Value>
  void append(Map& map, const Key& key, const Value& value) {
    auto& list = map[key];
    if (list.empty()) charge(kNodeBytes);
    charge(2 * sizeof(Value));
    list.push_back(value);
  }
  void count(std::map<EdgeId, std::uint32_t>& map, EdgeId edge) {
    if (map[edge]++ == 0) charge(kNodeBytes);
  }
  void refund(std::size_t bytes) { bytes_ -= bytes; }
  std::size_t bytes() const { return bytes_; }

  std::map<FrameId, std::vector<EdgeId>> incoming;
  std::map<LandmarkId, std::vector<FrameId>> observers;
  std::map<FrameId, std::vector<Unreached>> unreached;
  std::map<EdgeId, std::uint32_t> bound, support;
  std::map<EdgeId, std::vector<EdgeId>> consistent, carried_by;

 private:
  void charge(std::size_t bytes) {
    bytes_ += bytes;
    if (bytes_ > limit_ && chunks_.size() > 1) throw TooMuch();
  }
  const std::span<const ChunkId> chunks_;
  const std::size_t limit_;
  std::size_t bytes_ = 0;
};

template <typename T>
void sort_unique(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

class Recount {
 public:
  Recount(const EngineSnapshot& snapshot, const StoredGraph& graph, ChunkTable& table, std::size_t limit,
          const std::function<void(const Difference&)>& differs, const std::function<void(std::uint64_t)>& progress)
      : snapshot_(snapshot), graph_(graph), table_(table), limit_(limit), differs_(differs), progress_(progress) {}

  std::size_t run() {
    in_batches(suspects({Derived::kIncoming, Derived::kObservers, Derived::kUnreached, Derived::kBound,
                         Derived::kConsistent, Derived::kCarriedBy}),
               [&](std::span<const ChunkId> chunks) {
                 Expected expected(chunks, limit_ / 2);
                 collect(expected);
                 for (const ChunkId id : chunks) compare(id, expected);
                 peak_ = std::max(peak_, expected.bytes());
               });
    in_batches(suspects({Derived::kSupport}), [&](std::span<const ChunkId> chunks) {
      Expected expected(chunks, limit_ / 2);
      count_support(expected);
      for (const ChunkId id : chunks) compare_support(id, expected);
      peak_ = std::max(peak_, expected.bytes());
    });
    return peak_;
  }

 private:
  std::vector<ChunkId> suspects(std::initializer_list<Derived> kinds) {
    std::vector<ChunkId> ids;
    for (ChunkEntry& entry : table_.entries())
      if (std::any_of(kinds.begin(), kinds.end(), [&](Derived kind) { return entry.sum(kind) != 0; }))
        ids.push_back(entry.id);
    return ids;
  }

  // Calls `work` with as many chunks at a time as fit.
  template <typename Work>
  void in_batches(const std::vector<ChunkId>& ids, Work work) {
    std::size_t batch = std::max<std::size_t>(1, limit_ / 2 / kChunkBytes);
    for (std::size_t begin = 0; begin < ids.size();) {
      const std::size_t count = std::min(batch, ids.size() - begin);
      try {
        work(std::span(ids).subspan(begin, count));
        begin += count;
      } catch (const TooMuch&) {
        batch = std::max<std::size_t>(1, count / 2);
      }
    }
  }

  template <typename Visit>
  void for_each_frame(Visit visit) {
    std::uint64_t done = 0;
    for (const ChunkEntry& entry : table_.entries()) {
      const auto chunk = graph_.hot_chunk(entry.id);
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (chunk->frames[slot]) visit(frame_in(entry.id, slot), *chunk->frames[slot]), ++done;
      progress_(done);
    }
  }
  void for_each_observer(const std::function<void(FrameId, const FrameWarm&)>& visit) {
    std::uint64_t done = 0;
    for (const ChunkEntry& entry : table_.entries()) {
      const auto chunk = load_part<FrameWarm>(snapshot_, entry.id);
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (chunk.frames[slot] && table_.has(frame_in(entry.id, slot)))
          visit(frame_in(entry.id, slot), *chunk.frames[slot]), ++done;
      progress_(done);
    }
  }

  void collect(Expected& expected) {
    for_each_frame([&](FrameId id, const FrameHot& frame) {
      for (const Edge& edge : frame.edges) {
        if (expected.wants(edge.a)) expected.append(expected.incoming, edge.a, edge.id);
        for (const EdgeId other : edge.consistent_with) {
          if (expected.wants(id)) expected.append(expected.consistent, edge.id, other);
          if (expected.wants(other.frame)) expected.append(expected.consistent, other, edge.id);
        }
        for_each_carried_step(edge, [&](EdgeId step) {
          if (expected.wants(step.frame)) expected.append(expected.carried_by, step, edge.id);
        });
      }
      for (const Landmark& landmark : frame.landmarks)
        for (const AliasClaim& claim : landmark.claims)
          if (claim.closure.valid() && expected.wants(claim.closure.frame))
            expected.count(expected.bound, claim.closure);
    });
    SightedPaths paths(graph_);
    for_each_observer([&](FrameId id, const FrameWarm& frame) {
      for (const Observation& z : frame.observations)
        if (z.origin.valid() && expected.wants(z.origin.frame)) expected.count(expected.bound, z.origin);
      paths.visit(id, frame, [&](LandmarkId landmark, const std::vector<EdgeId>* path) {
        if (!expected.wants(landmark.base)) return;
        if (!path) return expected.append(expected.unreached, landmark.base, Unreached{landmark.slot, id});
        expected.append(expected.observers, landmark, id);
        if (auto& list = expected.observers[landmark]; list.size() == 2 * kMaxObservers) {
          keep_earliest(&list);
          expected.refund(2 * sizeof(FrameId) * kMaxObservers);
        }
      });
    });
    for (auto& [id, list] : expected.incoming) sort_unique(list);
    for (auto& [id, list] : expected.consistent) sort_unique(list);
    for (auto& [id, list] : expected.carried_by) sort_unique(list);
    for (auto& [id, list] : expected.unreached) sort_unique(list);
  }

  // Thousands may have passed a place, but no list is longer than kMaxObservers.
  void keep_earliest(std::vector<FrameId>* list) const {
    const auto earlier = [&](FrameId l, FrameId r) { return taken_in(*graph_.hot(l)) < taken_in(*graph_.hot(r)); };
    std::sort(list->begin(), list->end(), earlier);
    list->resize(kMaxObservers);
  }

  void compare(ChunkId id, Expected& expected) {
    const auto chunk = graph_.hot_chunk(id);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if (chunk->frames[slot]) compare(frame_in(id, slot), *chunk->frames[slot], expected);
  }
  void compare(FrameId id, const FrameHot& frame, Expected& expected) {
    if (auto& incoming = expected.incoming[id]; frame.incoming != incoming) {
      Difference difference;
      difference.frame = id;
      difference.what = "frame " + id.to_string() + ": its incoming edges are " +
                        std::to_string(frame.incoming.size()) + ", and should be " + std::to_string(incoming.size());
      difference.incoming = incoming;
      differs_(difference);
    }
    if (auto& unreached = expected.unreached[id]; frame.unreached != unreached) {
      Difference difference;
      difference.kind = Derived::kUnreached;
      difference.frame = id;
      difference.what = "frame " + id.to_string() + ": its unreached observers are " +
                        std::to_string(frame.unreached.size()) + ", and should be " + std::to_string(unreached.size());
      difference.unreached = unreached;
      differs_(difference);
    }
    for (std::uint32_t slot = 0; slot < frame.landmarks.size(); ++slot) {
      auto& observers = expected.observers[{id, slot}];
      const auto& stored = frame.landmarks[slot].observers;
      keep_first_observers(graph_, &observers);
      if (stored == observers) continue;
      Difference difference;
      difference.kind = Derived::kObservers;
      difference.frame = id;
      difference.what = "landmark " + LandmarkId{id, slot}.to_string() + ": its observers are " +
                        std::to_string(stored.size()) + ", and should be " + std::to_string(observers.size());
      difference.slot = slot;
      difference.observers = observers;
      differs_(difference);
    }
    for (const Edge& edge : frame.edges) {
      Difference difference;
      difference.frame = id;
      difference.edge = edge.id;
      const std::uint32_t bound = std::min<std::uint32_t>(expected.bound[edge.id], 0xffff);
      if (edge.bound != bound) {
        difference.kind = Derived::kBound;
        difference.count = bound;
        difference.what = "edge " + edge.id.to_string() + ": it binds " + std::to_string(edge.bound) + ", counted " +
                          std::to_string(bound);
        differs_(difference);
      }
      if (auto& consistent = expected.consistent[edge.id]; edge.consistent_with != consistent) {
        difference.kind = Derived::kConsistent;
        difference.closures = consistent;
        difference.what = "edge " + edge.id.to_string() + ": it agrees with " +
                          std::to_string(edge.consistent_with.size()) + " closures, " +
                          std::to_string(consistent.size()) + " agree with it";
        differs_(difference);
      }
      if (auto& carriers = expected.carried_by[edge.id]; edge.carried_by != carriers) {
        difference.kind = Derived::kCarriedBy;
        difference.closures = carriers;
        difference.what = "edge " + edge.id.to_string() + ": " + std::to_string(edge.carried_by.size()) +
                          " closures carry it, and " + std::to_string(carriers.size()) + " should";
        differs_(difference);
      }
    }
  }

  void count_support(Expected& expected) {
    SightedPaths paths(graph_);
    for_each_observer([&](FrameId id, const FrameWarm& frame) {
      paths.visit(id, frame, [&](LandmarkId, const std::vector<EdgeId>* path) {
        if (!path) return;
        for (const EdgeId edge : *path)
          if (expected.wants(edge.frame)) expected.count(expected.support, edge);
      });
    });
  }
  void compare_support(ChunkId id, Expected& expected) {
    const auto chunk = graph_.hot_chunk(id);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      if (!chunk->frames[slot]) continue;
      for (const Edge& edge : chunk->frames[slot]->edges) {
        const std::uint32_t support = expected.support[edge.id];
        if (edge.support == support) continue;
        Difference difference;
        difference.kind = Derived::kSupport;
        difference.frame = frame_in(id, slot);
        difference.edge = edge.id;
        difference.count = support;
        difference.what = "edge " + edge.id.to_string() + ": support " + std::to_string(edge.support) + ", counted " +
                          std::to_string(support);
        differs_(difference);
      }
    }
  }

  const EngineSnapshot& snapshot_;
  const StoredGraph& graph_;
  ChunkTable& table_;
  const std::size_t limit_;
  const std::function<void(const Difference&)>& differs_;
  const std::function<void(std::uint64_t)>& progress_;
  std::size_t peak_ = 0;
};

}  // namespace

std::size_t recount_derived(const EngineSnapshot& snapshot, const StoredGraph& graph, ChunkTable& table,
                            std::size_t memory_bytes, const std::function<void(const Difference&)>& differs,
                            const std::function<void(std::uint64_t)>& progress) {
  return Recount(snapshot, graph, table, memory_bytes, differs, progress).run();
}

}  // namespace relmap::storage
