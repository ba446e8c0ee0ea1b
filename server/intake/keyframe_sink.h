// The interface through which ingest uses the map, so that it can be tested without one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "proto/keyframe/keyframe.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::intake {

// Thread-safe.
class KeyframeSink {
 public:
  virtual ~KeyframeSink() = default;

  // Calls `begun` once, within this call or from any thread, with the number of the session with this uuid once it is
  // durable. CALIBRATION_CHANGED if the session began with another camera or flags.
  using Begun = std::function<void(const Result<SessionNumber>&)>;
  virtual void begin_session(const SessionHeader& header, Begun begun) = 0;
  // The number of the session with this uuid; nullopt if it has not begun.
  virtual std::optional<SessionNumber> find_session(const SessionUuid& uuid) const = 0;

  // Queues a record. If the result is OK, `done` is called once, from any thread, when the record is durable or will
  // never be. Otherwise `done` is not called; after BUDGET_EXCEEDED try again later. Records become durable in the
  // order in which they were submitted, or not at all.
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  virtual Status submit(storage::JournalRecord record, Done done) = 0;

  // Once the session's record was read or changed, view()->session() finds it in memory as long as the result lives.
  virtual std::shared_ptr<const void> hold_session(SessionNumber session) = 0;

  // The map. It may lag behind the durable records, except before the first submit().
  virtual std::shared_ptr<const storage::Graph> view() const = 0;

  // Approximate size of records that submit() would take now.
  virtual std::size_t free_bytes() const = 0;
};

}  // namespace relmap::intake
