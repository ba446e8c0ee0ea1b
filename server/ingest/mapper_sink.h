// The intake's way into the map.
#pragma once

#include "server/intake/keyframe_sink.h"
#include "server/map/mapper.h"

namespace relmap {

// `mapper` outlives it.
class MapperSink final : public KeyframeSink {
 public:
  explicit MapperSink(Mapper& mapper) : mapper_(mapper) {}

  Result<SessionNumber> begin_session(const SessionHeader& header) override { return mapper_.begin_session(header); }
  Status submit(JournalRecord record, Done done) override { return mapper_.submit(std::move(record), std::move(done)); }
  std::shared_ptr<const Graph> view() const override { return mapper_.view(); }
  std::size_t free_bytes() const override;

 private:
  Mapper& mapper_;
};

}  // namespace relmap
