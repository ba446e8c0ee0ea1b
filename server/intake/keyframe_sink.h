// Where keyframes go: what ingest needs of the map, so that it can be tested without one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "proto/keyframe/keyframe.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::intake {

// Thread-safe.
class KeyframeSink {
 public:
  virtual ~KeyframeSink() = default;

  // The number of the session with this uuid, durable. CALIBRATION_CHANGED if it began with another camera or flags.
  virtual Result<SessionNumber> begin_session(const SessionHeader& header) = 0;

  // Queues a record; `done` is called once, from any thread, when it is durable or will never be. Records become
  // durable in the order in which they were submitted, or not at all. BUDGET_EXCEEDED, without `done`: try again later.
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  virtual Status submit(storage::JournalRecord record, Done done) = 0;

  // The map; it may lag behind what is durable, except before the first submit().
  virtual std::shared_ptr<const storage::Graph> view() const = 0;

  // Bytes of records that submit() would take now, about.
  virtual std::size_t free_bytes() const = 0;
};

}  // namespace relmap::intake
