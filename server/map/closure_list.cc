#include "server/map/closure_list.h"

#include <algorithm>
#include <map>
#include <utility>

#include "server/map/suspicion.h"

namespace relmap::map {

namespace {

constexpr std::size_t kChunksBetweenLooks = 64;

// Visits the digests of frames from a chunk on, until `visit` returns false.
template <typename Visit>
Status visit_frames(const storage::MapView& map, storage::ChunkId from, const Proceed& proceed, const Visit& visit) {
  std::size_t chunks = 0;
  Status going = proceed();
  if (!going.ok()) return going;
  const Status read = map.visit_digests(from, [&](const storage::ChunkDigest& chunk) {
    if (++chunks % kChunksBetweenLooks == 0) going = proceed();
    if (!going.ok()) return false;
    for (const storage::FrameDigest& frame : chunk.frames)
      if (!visit(storage::frame_in(chunk.id, frame.slot), frame)) return false;
    return true;
  });
  return going.ok() ? read : going;
}

bool comes_before(ClosureOrder order, const ListedClosure& x, const ListedClosure& y) {
  if (order == ClosureOrder::kSuspicion) return x.suspicion != y.suspicion ? x.suspicion > y.suspicion : x.id < y.id;
  return x.time_us != y.time_us ? x.time_us > y.time_us : x.id > y.id;
}

}  // namespace

Result<std::vector<ListedClosure>> first_closures(const storage::MapView& map, const EdgeChoice& choice,
                                                  ClosureOrder order, const std::optional<ListedClosure>& after,
                                                  std::size_t count, const Proceed& proceed) {
  const auto before = [order](const ListedClosure& x, const ListedClosure& y) { return comes_before(order, x, y); };
  std::vector<ListedClosure> first;  // a heap with the last of them on top
  const Status read = visit_frames(map, {}, proceed, [&](FrameId, const storage::FrameDigest& frame) {
    for (const storage::ClosureDigest& closure : frame.closures) {
      if (closure.kind != storage::EdgeKind::kLoop) continue;
      const double suspicion =
          order == ClosureOrder::kSuspicion || choice.min_suspicion > 0 ? suspicion_value(closure) : 0;
      if (!choice.has(closure, frame.time_us, suspicion)) continue;
      const ListedClosure listed{closure.id, suspicion, frame.time_us};
      if ((after && !before(*after, listed)) || (first.size() == count && !before(listed, first.front()))) continue;
      if (first.size() == count) {
        std::pop_heap(first.begin(), first.end(), before);
        first.pop_back();
      }
      first.push_back(listed);
      std::push_heap(first.begin(), first.end(), before);
    }
    return true;
  });
  if (!read.ok()) return read;
  std::sort_heap(first.begin(), first.end(), before);
  return first;
}

namespace {

using VisitEdge = std::function<bool(const storage::Edge&, std::int64_t time_us)>;

// Visits the edges that are stored with this frame; false: `visit` did not want more. Throws where reads of the map do.
bool visit_edges_of(const storage::MapView& map, FrameId id, const EdgeChoice& choice, EdgeId after,
                    const VisitEdge& visit) {
  const auto hot = map.hot(id);
  if (!hot)
    throw StatusError(Status(Reason::DATA_LOSS, "frame " + id.to_string() + " is missing, of which the map has edges"));
  for (const storage::Edge& edge : hot->edges)
    if ((!after.valid() || edge.id > after) && choice.has(edge, hot->time_us) && !visit(edge, hot->time_us))
      return false;
  return true;
}

// The frames that store the edges of the region's frames.
Status visit_region(const storage::MapView& map, const EdgeChoice& choice, EdgeId after, const Proceed& proceed,
                    const VisitEdge& visit) {
  storage::FrameSet owners;
  for (const auto& [chunk, mask] : choice.region->chunks()) {
    if (Status going = proceed(); !going.ok()) return going;
    owners.set_chunk(chunk, owners.chunk(chunk) | mask);
    const auto frames = map.hot_frames(chunk);
    for (std::uint32_t slot = 0; slot < storage::kFramesPerChunk; ++slot)
      if (frames[slot] && choice.region->contains(storage::frame_in(chunk, slot)))
        for (const EdgeId incoming : frames[slot]->incoming) owners.insert(incoming.frame);
  }
  for (const auto& [chunk, mask] : owners.chunks()) {
    if (after.valid() && chunk < storage::chunk_id(after.frame)) continue;
    if (Status going = proceed(); !going.ok()) return going;
    for (std::uint32_t slot = 0; slot < storage::kFramesPerChunk; ++slot)
      if ((mask >> slot & 1) && !visit_edges_of(map, storage::frame_in(chunk, slot), choice, after, visit)) return {};
  }
  return {};
}

}  // namespace

Status visit_edges(const storage::MapView& map, const EdgeChoice& choice, EdgeId after, const Proceed& proceed,
                   const VisitEdge& visit) {
  if (choice.region) return visit_region(map, choice, after, proceed, visit);
  const auto from = after.valid() ? storage::chunk_id(after.frame) : storage::ChunkId{};
  return visit_frames(map, from, proceed, [&](FrameId id, const storage::FrameDigest& frame) {
    if (after.valid() && id < after.frame) return true;
    bool may_have = frame.joined && choice.may_have_motion(id, frame.time_us);
    for (const storage::ClosureDigest& closure : frame.closures)
      may_have =
          may_have || choice.has(closure, frame.time_us, choice.min_suspicion > 0 ? suspicion_value(closure) : 0);
    return !may_have || visit_edges_of(map, id, choice, after, visit);
  });
}

Result<std::vector<ClosureCell>> closure_cells(const storage::MapView& map, std::span<const SessionNumber> sessions,
                                               std::pair<SessionNumber, SessionNumber> after, std::size_t count,
                                               const Proceed& proceed) {
  const auto is_chosen = [&](SessionNumber session) {
    return sessions.empty() || std::binary_search(sessions.begin(), sessions.end(), session);
  };
  std::map<std::pair<SessionNumber, SessionNumber>, ClosureCell> cells;
  const auto cell_of = [&](SessionNumber a, SessionNumber b) -> ClosureCell* {
    const std::pair key(std::min(a, b), std::max(a, b));
    if (key <= after || (!is_chosen(a) && !is_chosen(b))) return nullptr;
    // A pair that is dropped has `count` pairs before it, and so has it later.
    if (cells.size() == count && key > cells.rbegin()->first) return nullptr;
    const auto cell = cells.try_emplace(key, ClosureCell{.session_a = key.first, .session_b = key.second}).first;
    if (cells.size() > count) cells.erase(std::prev(cells.end()));
    return &cell->second;
  };
  const Status read = visit_frames(map, {}, proceed, [&](FrameId, const storage::FrameDigest& frame) {
    for (const storage::ClosureDigest& closure : frame.closures) {
      if (closure.kind != storage::EdgeKind::kLoop) continue;
      ClosureCell* cell = cell_of(closure.a.session, closure.id.frame.session);
      if (!cell) continue;
      switch (closure.state) {
        case storage::EdgeState::kCandidate:
          ++cell->candidate;
          break;
        case storage::EdgeState::kAccepted:
          ++cell->accepted;
          break;
        case storage::EdgeState::kQuarantined:
          ++cell->quarantined;
          break;
        case storage::EdgeState::kRemoved:
          ++cell->removed;
          break;
      }
      if (closure.state != storage::EdgeState::kAccepted) continue;
      const double suspicion = suspicion_value(closure);
      if (!cell->most_suspicious.valid() || suspicion > cell->suspicion) {
        cell->most_suspicious = closure.id;  // of two the one with the lower id, which comes first
        cell->suspicion = suspicion;
      }
    }
    return true;
  });
  if (!read.ok()) return read;
  std::vector<ClosureCell> found;
  for (const auto& [key, cell] : cells) found.push_back(cell);
  return found;
}

}  // namespace relmap::map
