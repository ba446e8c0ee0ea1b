// The map as the intake sees it: a sink of keyframes, and a source of news for robots.
#pragma once

#include <optional>
#include <string>

#include "proto/keyframe/ingest_messages.h"
#include "server/intake/keyframe_sink.h"
#include "server/map/mapper.h"
#include "storage/graph/graph.h"

namespace relmap::ingest {

// `mapper` must outlive it.
class MapperSink final : public intake::KeyframeSink {
 public:
  explicit MapperSink(map::Mapper& mapper) : mapper_(mapper) {}

  void begin_session(const SessionHeader& header, Begun begun) override {
    mapper_.begin_session(header, std::move(begun));
  }
  std::optional<SessionNumber> find_session(const SessionUuid& uuid) const override {
    return mapper_.find_session(uuid);
  }
  Status submit(storage::JournalRecord record, Done done) override {
    return mapper_.submit(std::move(record), std::move(done));
  }
  std::shared_ptr<const void> hold_session(SessionNumber session) override { return mapper_.hold_session(session); }
  std::shared_ptr<const storage::Graph> view() const override { return mapper_.view(); }
  std::size_t free_bytes() const override;

 private:
  map::Mapper& mapper_;
};

struct ClosureNews {
  PoseNews news;
  std::string robot;  // whose keyframe is the newer end of the closure
};
// What a robot is told of a closure. `map` and `closure` are as passed to Mapper's watcher. Nullopt if the closure has
// no transform in metres.
std::optional<ClosureNews> closure_news(const storage::Graph& map, const storage::Edge& closure);

}  // namespace relmap::ingest
