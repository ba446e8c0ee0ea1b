#include "tools/bench/recorded_drive.h"

#include "proto/base/crc32c.h"
#include "storage/engine/memory_engine.h"

namespace relmap::bench {

RecordedDrive::RecordedDrive(const rba::RbaOptions& rba) : rba_(rba) {
  auto engine = storage::make_memory_engine();
  const std::uint64_t epoch = engine->acquire().or_throw();
  map_ =
      storage::Map::open(std::move(engine), epoch, std::make_shared<storage::Budget>(std::size_t{4} << 30)).or_throw();
  builder_ = std::make_unique<map::MapBuilder>(*map_, nullptr, rba_);
}

void RecordedDrive::add(const Keyframe& keyframe) {
  if (update_us_.empty())
    builder_->apply(++sequence_, storage::SessionRecord{kSession, keyframe.session.name, keyframe.session});
  const Bytes payload = encode_keyframe(keyframe);
  const map::Applied applied =
      builder_->apply(++sequence_, storage::KeyframeRecord{kSession, crc32c(payload), payload});
  if (!applied.frame) throw StatusError(Status(Reason::CORRUPT, "keyframe " + std::to_string(keyframe.sequence)));
  update_us_.push_back(1e6 * applied.relax_seconds);
}

rba::RbaSummary RecordedDrive::relax_fully() { return rba::Relaxer(*map_, rba_).relax_fully(); }

}  // namespace relmap::bench
