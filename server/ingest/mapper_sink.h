// The map as a sink of the intake.
#pragma once

#include "server/intake/keyframe_sink.h"
#include "server/map/mapper.h"

namespace relmap::ingest {

// `mapper` must outlive it.
class MapperSink final : public intake::KeyframeSink {
 public:
  explicit MapperSink(map::Mapper& mapper) : mapper_(mapper) {}

  Result<SessionNumber> begin_session(const SessionHeader& header) override { return mapper_.begin_session(header); }
  Status submit(storage::JournalRecord record, Done done) override {
    return mapper_.submit(std::move(record), std::move(done));
  }
  std::shared_ptr<const storage::Graph> view() const override { return mapper_.view(); }
  std::size_t free_bytes() const override;

 private:
  map::Mapper& mapper_;
};

}  // namespace relmap::ingest
