#include "storage/format/keys.h"
#include "storage/map/digest_records.h"
#include "storage/map/indices.h"
#include "storage/map/map_view_impl.h"
#include "storage/map/part_loader.h"

namespace relmap::storage {

void MapView::Impl::check_alive() const {
  if (ledger->expired(version))
    throw StatusError(Status(Reason::VIEW_EXPIRED, "map version " + std::to_string(version) +
                                                       " was cut off: old views hold more memory than their share"));
}

MapView::MapView(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MapView::~MapView() = default;

std::uint64_t MapView::version() const { return impl_->version; }
bool MapView::expired() const { return impl_->ledger->expired(impl_->version); }
const MapFacts& MapView::state() const { return impl_->state; }
std::size_t MapView::pending_frames() const { return impl_->pending_frames; }
std::shared_ptr<const EngineSnapshot> MapView::committed() const { return impl_->snapshot; }

std::shared_ptr<const FrameHot> MapView::hot(FrameId id) const {
  impl_->check_alive();
  const DirtyChunk* dirty = find_dirty(*impl_->dirty, chunk_id(id));
  if (dirty && dirty->hot[slot_of(id)]) return dirty->hot[slot_of(id)];
  if (dirty && dirty->removed) return nullptr;
  return impl_->cache->frame<FrameHot>(*impl_->snapshot, id);
}

Slots<FrameHot> MapView::hot_frames(ChunkId chunk) const {
  impl_->check_alive();
  const DirtyChunk* dirty = find_dirty(*impl_->dirty, chunk);
  if (dirty && dirty->removed) return {};
  std::uint64_t committed = ~std::uint64_t{0};
  for (std::uint32_t slot = 0; dirty && slot < kFramesPerChunk; ++slot)
    if (dirty->hot[slot]) committed &= ~(std::uint64_t{1} << slot);
  Slots<FrameHot> frames = impl_->cache->hot_frames(*impl_->snapshot, chunk, committed);
  for (std::uint32_t slot = 0; dirty && slot < kFramesPerChunk; ++slot)
    if (dirty->hot[slot]) frames[slot] = dirty->hot[slot];
  return frames;
}

std::shared_ptr<const FrameWarm> MapView::warm(FrameId id) const {
  impl_->check_alive();
  const DirtyChunk* dirty = find_dirty(*impl_->dirty, chunk_id(id));
  if (dirty && dirty->warm[slot_of(id)]) return dirty->warm[slot_of(id)];
  if (dirty && dirty->removed) return nullptr;
  return impl_->cache->frame<FrameWarm>(*impl_->snapshot, id);
}

std::shared_ptr<const FrameCold> MapView::cold(FrameId id) const {
  impl_->check_alive();
  const auto session = impl_->session(id.session);
  if (!session || is_removed(*session, id)) return nullptr;
  const DirtyChunk* dirty = find_dirty(*impl_->dirty, chunk_id(id));
  if (dirty && dirty->cold[slot_of(id)]) return dirty->cold[slot_of(id)];
  return impl_->cache->cold(*impl_->snapshot, id);
}

void MapView::visit_sessions(SessionNumber from, const SessionVisit& visit) const {
  relmap::storage::visit_sessions(*impl_->snapshot, *impl_->sessions, from, visit);
}

SessionCounts MapView::session_counts() const { return impl_->session_counts; }

std::optional<Session> MapView::session(SessionNumber number) const {
  const auto session = impl_->session(number);
  return session ? std::optional<Session>(*session) : std::nullopt;
}

void MapView::visit_skipped(SessionNumber session, std::uint32_t sequence, const SkippedVisit& visit) const {
  impl_->check_alive();
  relmap::storage::visit_skipped(*impl_->snapshot, *impl_->skipped, session, sequence, visit);
}

std::vector<FrameId> MapView::labelled(const std::string& label) const {
  impl_->check_alive();
  return frames_labelled(*impl_->snapshot, *impl_->labels, label);
}

std::vector<std::string> MapView::labels(const std::string& prefix) const {
  impl_->check_alive();
  return labels_beginning(*impl_->snapshot, *impl_->labels, prefix);
}

Status MapView::visit_digests(ChunkId from, const std::function<bool(const ChunkDigest&)>& visit,
                              DigestsOf which) const {
  try {
    impl_->check_alive();
    relmap::storage::visit_digests(*impl_->snapshot, impl_->digests_hold, impl_->cache->budget(), *impl_->dirty, from,
                                   which, [&](const ChunkDigest& digests) {
                                     impl_->check_alive();
                                     return visit(digests);
                                   });
    return {};
  } catch (const StatusError& error) {
    return error.status();
  }
}

Status MapView::scan_words(const std::function<bool(FrameId)>& known,
                           const std::function<void(FrameId, std::span<const std::uint32_t>)>& visit) const {
  const auto visit_unknown = [&](FrameId id, std::span<const std::uint32_t> words) {
    if (!known(id)) visit(id, words);
  };
  const auto all_known = [&](const Session& session, ChunkId chunk) {
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if (const FrameId id = frame_in(chunk, slot); id.index >= session.first && id.index <= session.last && !known(id))
        return false;
    return true;
  };
  try {
    impl_->check_alive();
    visit_sessions(0, [&](const Session& session) {
      if (session.frames == 0) return true;
      for (ChunkId chunk{session.number, chunk_of({session.number, session.first})};
           chunk.chunk <= chunk_of({session.number, session.last}); ++chunk.chunk) {
        if (all_known(session, chunk)) continue;
        const Status status =
            impl_->snapshot->scan(keys::part(Part::kWords, chunk), [&](std::string_view key, ByteSpan value) {
              const auto id = keys::frame_of(key);
              if (!id) throw StatusError(Status(Reason::DATA_LOSS, "a key of words that names no frame"));
              visit_unknown(*id, decode_words_record(value, *id));
              return true;
            });
        throw_if(status);
      }
      return true;
    });
    for (const auto& [chunk, dirty] : *impl_->dirty)
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (dirty->cold[slot] && !dirty->cold[slot]->words.empty())
          visit_unknown(frame_in(chunk, slot), dirty->cold[slot]->words);
    return {};
  } catch (const StatusError& error) {
    return error.status();
  }
}

}  // namespace relmap::storage
