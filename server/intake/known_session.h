// What the map knows of sessions and of what became of their sequences. Reading it may wait for the disk, so it is
// asked for first, and read without the intake's lock.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/intake/keyframe_sink.h"
#include "storage/graph/graph.h"

namespace relmap::intake {

// What became of a sequence.
struct Judged {
  std::uint32_t crc = 0;
  Reason reason = Reason::OK;  // not OK: refused, or given up
  bool gap = false;            // no keyframe is known to have come
};

// A session as the map shows it.
struct KnownSession {
  std::optional<storage::Session> session;  // nullopt: it has not begun
  std::vector<storage::Skipped> skipped;    // of its newest sequences, ascending
  std::shared_ptr<const void> held;         // keeps its record in memory
};

struct MapQuestion {
  SessionUuid uuid;
  SessionNumber session = 0;
  std::optional<std::uint32_t> sequence;  // what became of it; nullopt: what is known of the session
};
struct MapAnswer {
  Status failed;  // IO_ERROR, DATA_LOSS; BUDGET_EXCEEDED: the map does not show it yet
  KnownSession session;
  Judged judged;
};

// May wait for the disk.
MapAnswer answer(KeyframeSink& sink, const MapQuestion& question);

}  // namespace relmap::intake
