#include "storage/maintenance/stored_graph.h"

#include <algorithm>

namespace relmap::storage {

std::shared_ptr<const StoredPart<FrameHot>> StoredGraph::hot_chunk(ChunkId id) const {
  if (!lru_.empty() && lru_.front().id == id) return lru_.front().part;
  if (const auto found = index_.find(id); found != index_.end()) {
    lru_.splice(lru_.begin(), lru_, found->second);
    return lru_.front().part;
  }
  auto part = std::make_shared<const StoredPart<FrameHot>>(load_part<FrameHot>(snapshot_, id));
  bytes_ += sizeof *part + part->bytes;
  lru_.push_front({id, part});
  index_[id] = lru_.begin();
  while (bytes_ > limit_ && lru_.size() > 1) {
    bytes_ -= sizeof *part + lru_.back().part->bytes;
    index_.erase(lru_.back().id);
    lru_.pop_back();
  }
  peak_ = std::max(peak_, bytes_);
  return part;
}

std::shared_ptr<const FrameHot> StoredGraph::hot(FrameId id) const {
  return id.valid() ? hot_chunk(chunk_id(id))->frames[slot_of(id)] : nullptr;
}

std::shared_ptr<const FrameWarm> StoredGraph::warm(FrameId id) const {
  return load_part<FrameWarm>(snapshot_, chunk_id(id)).frames[slot_of(id)];
}

std::shared_ptr<const FrameCold> StoredGraph::cold(FrameId id) const {
  return load_part<FrameCold>(snapshot_, chunk_id(id)).frames[slot_of(id)];
}

std::optional<Session> StoredGraph::session(SessionNumber number) const {
  for (const Session& session : sessions_)
    if (session.number == number) return session;
  return std::nullopt;
}

std::vector<FrameId> StoredGraph::labelled(const std::string& label) const {
  return frames_labelled(snapshot_, {}, label);
}

std::vector<std::string> StoredGraph::labels(const std::string& prefix) const {
  return labels_beginning(snapshot_, {}, prefix);
}

}  // namespace relmap::storage
