#include "tools/bench/recorded_drive.h"

#include "proto/crc32c.h"
#include "storage/memory_engine.h"

namespace relmap::bench {

RecordedDrive::RecordedDrive(const RbaOptions& rba) : rba_(rba) {
  auto engine = make_memory_engine();
  const std::uint64_t epoch = engine->acquire().or_throw();
  map_ = Map::open(std::move(engine), epoch, std::make_shared<Budget>(std::size_t{4} << 30)).or_throw();
  builder_ = std::make_unique<MapBuilder>(*map_, nullptr, rba_);
}

void RecordedDrive::add(const Keyframe& keyframe) {
  if (update_us_.empty())
    builder_->apply(++sequence_, SessionRecord{kSession, keyframe.session.name, keyframe.session});
  const Bytes payload = encode_keyframe(keyframe);
  const Applied applied = builder_->apply(++sequence_, KeyframeRecord{kSession, crc32c(payload), payload});
  if (!applied.frame) throw StatusError(Status(Reason::CORRUPT, "keyframe " + std::to_string(keyframe.sequence)));
  update_us_.push_back(1e6 * applied.relax_seconds);
}

RbaSummary RecordedDrive::relax_fully() { return Relaxer(*map_, rba_).relax_fully(); }

}  // namespace relmap::bench
