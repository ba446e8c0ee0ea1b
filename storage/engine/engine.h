// What the map needs of a store, and no more: so that RocksDB, memory, and later an object store without
// cross-object transactions can all provide it. One conformance suite (engine_conformance.h) runs over every engine.
//
// Thread safety: every method may be called from any thread; append() calls are serialised by the engine, in order.
// Errors: IO_ERROR, DATA_LOSS (with the range affected), STALE_OWNER (another acquire() has happened since),
// UNKNOWN_FORMAT_VERSION, READ_ONLY.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/ids.h"
#include "proto/base/status.h"

namespace relmap::storage {

// A consistent state of the keys at one commit. Released by its destructor; holding one never blocks a commit.
class EngineSnapshot {
 public:
  virtual ~EngineSnapshot() = default;

  // Number of the last commit it holds: 0 for none.
  virtual std::uint64_t commit_number() const = 0;
  // nullopt: there is no such key.
  virtual Result<std::optional<Bytes>> get(std::string_view key) const = 0;
  using Visit = std::function<bool(std::string_view key, ByteSpan value)>;
  // Keys that begin with `prefix`, ascending from `from` on, until `visit` returns false.
  virtual Status scan_from(std::string_view prefix, std::string_view from, const Visit& visit) const = 0;
  Status scan(std::string_view prefix, const Visit& visit) const { return scan_from(prefix, prefix, visit); }
};

struct Put {
  std::string key;
  Bytes value;
};

// Of an engine's long work, in bytes; total 0: not known. Called by the thread that asked for the work. What it
// answers, if not ok, ends the work with just that.
using EngineProgress = std::function<Status(std::uint64_t done, std::uint64_t total)>;

struct EngineStats {
  std::uint64_t map_bytes = 0;        // on disk: what is committed
  std::uint64_t journal_bytes = 0;    // on disk
  std::uint64_t journal_records = 0;  // kept
  std::uint64_t blob_bytes = 0;       // of map_bytes: large values, in files of their own
  std::uint64_t garbage_bytes = 0;    // of blob_bytes: replaced or deleted since; compact() gives them back
  std::string dropped;                // what opening cut off the journal, in words; empty: nothing
  std::vector<std::pair<std::string, std::string>> properties;  // the engine's own, for people
};

class Engine {
 public:
  virtual ~Engine() = default;

  // Takes ownership of the map. Every append and commit by an older epoch fails with STALE_OWNER from now on.
  virtual Result<std::uint64_t> acquire() = 0;

  // Appends records; returns the journal sequence of the last, contiguous from 1, once all are durable. On failure none
  // counts, and it may be tried again. No records: whether some would be taken. DISK_FULL below the low-water mark,
  // too.
  virtual Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) = 0;
  // Records from sequence `from` on, ascending, until `visit` returns false. A record that is damaged below the highest
  // sequence known to be durable is DATA_LOSS; a damaged tail above it was dropped when the engine opened.
  virtual Status read_journal(std::uint64_t from,
                              const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const = 0;
  virtual std::uint64_t first_journal_sequence() const = 0;  // lowest kept; last + 1 if none is
  virtual std::uint64_t last_journal_sequence() const = 0;   // 0: none was ever written
  // Records up to and including `through` are no longer needed.
  virtual Status trim(std::uint64_t through) = 0;

  // All or nothing, and durable on return. `applied_sequence` is the journal sequence that the state contains.
  // Committing the same applied_sequence again with the same content changes nothing.
  virtual Status commit(std::uint64_t epoch, std::uint64_t applied_sequence, std::span<const Put> puts,
                        std::span<const std::string> deletes) = 0;
  virtual std::uint64_t applied_sequence() const = 0;  // of the last commit
  virtual std::shared_ptr<const EngineSnapshot> snapshot() const = 0;

  // A number never given before, durable; from 1.
  virtual Result<SessionNumber> allocate_session(std::uint64_t epoch) = 0;

  // A copy of the store in `directory`, which must not exist or be empty, nor lie where the store does
  // (INVALID_ARGUMENT), made beside appends and
  // commits; what was durable before the call is in it, and the hash of its map where all of it can be read. It gets
  // its name when it is complete and durable. UNSUPPORTED where an engine cannot.
  virtual Status checkpoint(const std::string& directory, const EngineProgress& progress) = 0;
  // Gives back the space of what was replaced and deleted, as far as no snapshot holds it. Commits go on. DISK_FULL
  // where there is no room for a second copy of what is kept.
  virtual Status compact(const EngineProgress& progress) = 0;
  virtual Result<EngineStats> stats() const = 0;

  // Bytes of memory that the engine holds now (caches, memtables).
  virtual std::size_t memory_bytes() const = 0;
};

}  // namespace relmap::storage
