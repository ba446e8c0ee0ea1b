#include "storage/format/packed_part.h"

#include <algorithm>

#include "proto/base/crc32c.h"
#include "proto/base/mutex.h"
#include "storage/format/frame_codec.h"

namespace relmap::storage {

namespace {

std::optional<FrameHot> decode(ByteSpan body, FrameId id, const FrameHot*) { return decode_hot(body, id); }
std::optional<FrameWarm> decode(ByteSpan body, FrameId id, const FrameWarm*) { return decode_warm(body, id); }

}  // namespace

void throw_lost(Part part, const std::string& where, const std::string& what) {
  throw StatusError(Status(Reason::DATA_LOSS, std::string(part_name(part)) + " part of " + where + ": " + what));
}

template <typename Frame>
PackedPart<Frame>::PackedPart(std::shared_ptr<Budget> budget, ChunkId id, Records records)
    : budget_(std::move(budget)), id_(id), records_(std::move(records)), bytes_(sizeof *this) {
  for (const Record& record : records_) {
    bytes_ += record.body.size();
    if (record.frame) bytes_ += memory_bytes(*record.frame);
  }
  budget_->charge(Share::kCache, bytes_);
}

template <typename Frame>
PackedPart<Frame>::~PackedPart() {
  budget_->release(Share::kCache, bytes_);
}

template <typename Frame>
std::shared_ptr<const Frame> PackedPart<Frame>::frame(std::uint32_t slot) const {
  const MutexLock lock(mutex_);
  return frame_locked(slot);
}

template <typename Frame>
Slots<Frame> PackedPart<Frame>::frames(std::uint64_t slots) const {
  Slots<Frame> all;
  const MutexLock lock(mutex_);
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
    if ((slots >> slot) & 1) all[slot] = frame_locked(slot);
  return all;
}

template <typename Frame>
const std::shared_ptr<const Frame>& PackedPart<Frame>::frame_locked(std::uint32_t slot) const {
  Record& record = records_[slot];
  if (record.frame || !record.there()) return record.frame;
  const FrameId id = frame_in(id_, slot);
  const auto lost = [&](const std::string& what) { throw_lost(kPartOf<Frame>, "frame " + id.to_string(), what); };
  if (record.damage) lost(record.damage->to_string());
  if (crc32c(record.body) != record.crc) lost("checksum");
  auto decoded = decode(record.body, id, static_cast<const Frame*>(nullptr));
  if (!decoded) lost("malformed record");
  record.frame = std::make_shared<const Frame>(std::move(*decoded));
  const std::size_t grown = memory_bytes(*record.frame);
  budget_->charge(Share::kCache, grown);
  bytes_ += grown;
  return record.frame;
}

template <typename Frame>
typename PackedPart<Frame>::Record PackedPart<Frame>::record(std::uint32_t slot) const {
  const MutexLock lock(mutex_);
  return records_[slot];
}

template <typename Frame>
bool PackedPart<Frame>::empty() const {
  const MutexLock lock(mutex_);
  return std::none_of(records_.begin(), records_.end(), [](const Record& record) { return record.there(); });
}

template <typename Frame>
bool PackedPart<Frame>::sound() const {
  const MutexLock lock(mutex_);
  return std::all_of(records_.begin(), records_.end(), [](const Record& record) {
    return !record.there() || (!record.damage && crc32c(record.body) == record.crc);
  });
}

template <typename Frame>
Status unpack(std::shared_ptr<const Bytes> bytes, ChunkId id, typename PackedPart<Frame>::Records& records,
              std::uint64_t* commit) {
  const auto reader = PartReader::open(*bytes, kPartOf<Frame>, id);
  if (!reader.ok()) return reader.status();
  for (std::size_t i = 0; i < reader->size(); ++i)
    records[reader->slot(i)] = {bytes, reader->stored(i), reader->crc(i), nullptr, nullptr};
  *commit = std::max(*commit, reader->commit());
  return {};
}

template class PackedPart<FrameHot>;
template class PackedPart<FrameWarm>;
template Status unpack<FrameHot>(std::shared_ptr<const Bytes>, ChunkId, PackedPart<FrameHot>::Records&, std::uint64_t*);
template Status unpack<FrameWarm>(std::shared_ptr<const Bytes>, ChunkId, PackedPart<FrameWarm>::Records&,
                                  std::uint64_t*);

}  // namespace relmap::storage
