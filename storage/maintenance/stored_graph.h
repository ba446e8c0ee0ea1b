// The graph as it stands in a snapshot, read past whatever is damaged: a frame that cannot be read does not exist.
// Chunks are decoded into a cache of its own, bounded in bytes, so that a walk over the whole map does not evict from
// the daemon's cache what its callers need.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <unordered_map>
#include <vector>

#include "storage/graph/graph.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/map/indices.h"

namespace relmap::storage {

// For one thread.
class StoredGraph final : public Graph {
 public:
  StoredGraph(const EngineSnapshot& snapshot, std::vector<Session> sessions, std::size_t cache_bytes)
      : snapshot_(snapshot), sessions_(std::move(sessions)), limit_(cache_bytes) {}

  std::shared_ptr<const FrameHot> hot(FrameId id) const override;
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override;
  std::shared_ptr<const FrameCold> cold(FrameId id) const override;
  void visit_sessions(SessionNumber from, const SessionVisit& visit) const override {
    for (const Session& session : sessions_)
      if (session.number >= from && !visit(session)) return;
  }
  std::optional<Session> session(SessionNumber number) const override;
  void visit_skipped(SessionNumber session, std::uint32_t sequence, const SkippedVisit& visit) const override {
    relmap::storage::visit_skipped(snapshot_, {}, session, sequence, visit);
  }
  std::vector<FrameId> labelled(const std::string& label) const override;
  std::vector<std::string> labels(const std::string& prefix) const override;

  // All hot parts of a chunk.
  std::shared_ptr<const StoredPart<FrameHot>> hot_chunk(ChunkId id) const;

  std::size_t peak_bytes() const { return peak_; }

 private:
  struct Entry {
    ChunkId id;
    std::shared_ptr<const StoredPart<FrameHot>> part;
  };
  const EngineSnapshot& snapshot_;
  const std::vector<Session> sessions_;
  const std::size_t limit_;
  mutable std::list<Entry> lru_;  // most recently used first
  mutable std::unordered_map<ChunkId, std::list<Entry>::iterator> index_;
  mutable std::size_t bytes_ = 0, peak_ = 0;
};

}  // namespace relmap::storage
