// The interface between the map and its store. It asks for no more than the map needs, so that RocksDB, memory, and
// later an object store without cross-object transactions can all implement it. One conformance suite
// (engine_conformance.h) runs over every engine.
//
// Thread safety: every method may be called from any thread; the engine serialises append() calls. Errors: IO_ERROR,
// DATA_LOSS (with the range affected), STALE_OWNER (another acquire() has happened since), UNKNOWN_FORMAT_VERSION,
// READ_ONLY.
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

// A consistent state of the keys as of one commit. The destructor releases it; holding one never blocks a commit.
class EngineSnapshot {
 public:
  virtual ~EngineSnapshot() = default;

  // Number of the last commit that the snapshot contains; 0 if there was none.
  virtual std::uint64_t commit_number() const = 0;
  // nullopt if there is no such key.
  virtual Result<std::optional<Bytes>> get(std::string_view key) const = 0;
  using Visit = std::function<bool(std::string_view key, ByteSpan value)>;
  // Visits the keys that begin with `prefix` in ascending order, starting at `from`, until `visit` returns false.
  virtual Status scan_from(std::string_view prefix, std::string_view from, const Visit& visit) const = 0;
  Status scan(std::string_view prefix, const Visit& visit) const { return scan_from(prefix, prefix, visit); }
};

struct Put {
  std::string key;
  Bytes value;
};

// Receives the progress of a long operation in bytes; `total` is 0 where it is not known. It is called by the thread
// that started the operation. If it returns a status other than OK, the operation ends with that status.
using EngineProgress = std::function<Status(std::uint64_t done, std::uint64_t total)>;

struct EngineStats {
  std::uint64_t map_bytes = 0;        // what is committed, on disk
  std::uint64_t journal_bytes = 0;    // on disk
  std::uint64_t journal_records = 0;  // records that are kept
  std::uint64_t blob_bytes = 0;       // part of map_bytes: large values, which have files of their own
  std::uint64_t garbage_bytes = 0;    // part of blob_bytes: values replaced or deleted since; compact() frees them
  std::string dropped;                // what was cut off the journal when it was opened, in words; empty if nothing was
  std::vector<std::pair<std::string, std::string>> properties;  // specific to the engine, for people to read
};

// A folder that is to be made.
struct NewFolder {
  NewFolder(std::string folder, std::vector<std::string> folders = {})  // NOLINT: a path is one anywhere
      : path(std::move(folder)), roots(std::move(folders)) {}

  std::string path;
  // Not empty: it may only be made below one of these, by a path without links, through folders that only this user or
  // root can change. So whoever may ask for copies, but is not this user, cannot have anything else overwritten.
  std::vector<std::string> roots;
};

// The number that follows `last` after so many that are skipped. BUDGET_EXCEEDED if there is none.
inline Result<SessionNumber> next_session(SessionNumber last, SessionNumber skipped) {
  if (~last <= skipped) return Status(Reason::BUDGET_EXCEEDED, "no session numbers are left");
  return last + skipped + 1;
}

class Engine {
 public:
  virtual ~Engine() = default;

  // Takes ownership of the map and returns the new epoch. From now on every append and commit with an older epoch fails
  // with STALE_OWNER.
  virtual Result<std::uint64_t> acquire() = 0;

  // Appends records and returns the journal sequence of the last one, once all of them are durable. Sequences are
  // contiguous from 1. If the call fails, none of the records counts and the caller may try again. Without records, the
  // call reports whether an append would succeed now. DISK_FULL also when free space is below the low-water mark.
  virtual Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) = 0;
  // Visits the records from sequence `from` on, in ascending order, until `visit` returns false. DATA_LOSS if a record
  // is damaged that lies below the highest sequence known to be durable; a damaged tail above that was dropped when the
  // engine opened.
  virtual Status read_journal(std::uint64_t from,
                              const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const = 0;
  virtual std::uint64_t first_journal_sequence() const = 0;  // lowest that is kept; last + 1 if none is
  virtual std::uint64_t last_journal_sequence() const = 0;   // 0 if none was ever written
  // Allows the engine to delete the records up to and including `through`.
  virtual Status trim(std::uint64_t through) = 0;

  // Applies all puts and deletes atomically; they are durable on return. `applied_sequence` is the journal sequence
  // that the state contains. Committing the same applied_sequence again with the same content changes nothing.
  virtual Status commit(std::uint64_t epoch, std::uint64_t applied_sequence, std::span<const Put> puts,
                        std::span<const std::string> deletes) = 0;
  virtual std::uint64_t applied_sequence() const = 0;  // of the last commit
  virtual std::shared_ptr<const EngineSnapshot> snapshot() const = 0;

  // Returns a session number that was never returned before, and makes that durable. Numbers begin at 1; `skipped` of
  // them are passed over, and are never returned either. BUDGET_EXCEEDED if there are not so many left.
  virtual Result<SessionNumber> allocate_session(std::uint64_t epoch, SessionNumber skipped = 0) = 0;

  // Copies the store to a folder, which must be missing or empty and must not overlap the store (INVALID_ARGUMENT), and
  // must be one that may be made (NOT_ALLOWED).
  // Appends and commits go on meanwhile. The copy holds everything that was durable before the call and, where all of
  // the map can be read, the hash of its map. The directory gets its name when the copy is complete and durable.
  // UNSUPPORTED if the engine cannot make copies.
  virtual Status checkpoint(const NewFolder& to, const EngineProgress& progress) = 0;
  // Frees the space of what was replaced and deleted, as far as no snapshot holds it. Commits go on meanwhile.
  // DISK_FULL if there is no room for a second copy of what is kept.
  virtual Status compact(const EngineProgress& progress) = 0;
  virtual Result<EngineStats> stats() const = 0;

  // Bytes of memory that the engine holds now (caches, memtables).
  virtual std::size_t memory_bytes() const = 0;
};

}  // namespace relmap::storage
