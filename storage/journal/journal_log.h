// The journal as files: append-only segments, journal-SEQUENCE-SALT.log (docs/storage-format.md). A record is durable
// when append() has returned. Each record carries the highest sequence that was durable before it. Recovery uses it to
// distinguish a torn tail that was never acknowledged, which is dropped, from lost acknowledged records (DATA_LOSS).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "storage/io/file.h"
#include "storage/journal/journal_segment.h"

namespace relmap::storage {

struct JournalLogOptions {
  std::uint64_t segment_bytes = std::uint64_t{16} << 20;  // a segment of this size or more is followed by a new one
  bool read_only = false;                                 // neither repairs nor appends
  std::function<std::uint64_t()> salts = random_salt;     // draws the salt of each new segment; tests have their own
};

// Thread-safe.
class JournalLog {
 public:
  // Opens the journal in `directory`. Records up to `applied` are not needed any more, damaged or not, and cannot be
  // read. A damaged tail is dropped; dropped() says so. Lost records do not make open() fail: loss() names them, the
  // records before them can be read, and appends are refused. IO_ERROR, UNKNOWN_FORMAT_VERSION.
  static Result<std::unique_ptr<JournalLog>> open(std::shared_ptr<FileSystem> files, const std::string& directory,
                                                  std::uint64_t applied, JournalLogOptions options = {});

  // Appends `records` and returns the sequence of the last one, once all of them are durable. If the call fails, none
  // of them counts, with one exception: if the machine stops before the disk has taken them back and before the next
  // append has succeeded, the next start may find them. After a failure the next append begins a new segment, so the
  // failure lasts as long as its cause. Without records, the call reports whether an append would succeed now.
  Result<std::uint64_t> append(std::span<const Bytes> records);
  Status read(std::uint64_t from, const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const;
  // Deletes the segments that hold nothing above `through`. Other records up to `through` can no longer be read either.
  Status trim(std::uint64_t through);

  // Where all records are trimmed, deletes the last segment that held any, too, and begins a new one. The bytes of a
  // record are then not on the disk any more.
  Status leave_applied();

  // The files that hold the records from first() on, open: they can be read even if they are trimmed later. Of each
  // file, the first `bytes` bytes are durable.
  struct KeptFile {
    std::string name;
    std::unique_ptr<ReadFile> file;
    std::uint64_t bytes = 0;
  };
  Result<std::vector<KeptFile>> keep() const;
  Result<std::uint64_t> bytes() const;  // of the files that keep() returns

  std::uint64_t first() const;  // lowest sequence that can be read; last() + 1 if none can
  std::uint64_t last() const;   // 0 if no record was ever written
  // OK, or DATA_LOSS naming the range of records that were durable once and cannot be read.
  const Status& loss() const { return loss_; }
  // What open() dropped, in words; empty if nothing.
  const std::string& dropped() const { return dropped_; }

 private:
  struct Segment {
    std::uint64_t first = 0;            // sequence of its first record
    std::optional<std::uint64_t> salt;  // nullopt: a segment of version 1
    std::string path;
  };

  // Where the records end.
  struct Tail {
    std::size_t segment = 0;
    std::uint64_t end = 0;  // offset in the segment; 0: there is no usable segment
    std::uint64_t sequence = 0;
  };

  JournalLog(std::shared_ptr<FileSystem> files, std::string directory, JournalLogOptions options)
      : files_(std::move(files)),
        directory_(std::move(directory)),
        options_(std::move(options)),
        next_salt_(options_.salts()) {}
  Status recover(std::uint64_t applied) RELMAP_REQUIRES(mutex_);
  Status loss(std::uint64_t durable, const Status& unreadable) const RELMAP_REQUIRES(mutex_);
  Status continue_behind(const Tail& tail) RELMAP_REQUIRES(mutex_);
  Status begin_segment() RELMAP_REQUIRES(mutex_);
  Status write(std::span<const Bytes> records) RELMAP_REQUIRES(mutex_);
  void leave_segment() RELMAP_REQUIRES(mutex_);
  Segment segment(const SegmentName& name) const;

  const std::shared_ptr<FileSystem> files_;
  const std::string directory_;
  const JournalLogOptions options_;
  Status loss_;
  std::string dropped_;

  mutable Mutex mutex_;
  std::vector<Segment> segments_ RELMAP_GUARDED_BY(mutex_);  // ascending; the last is appended to
  std::unique_ptr<AppendFile> file_
      RELMAP_GUARDED_BY(mutex_);  // of the last segment; null if a write to it failed or it is of version 1
  std::uint64_t next_salt_ RELMAP_GUARDED_BY(mutex_) = 0;   // of the next segment
  std::uint64_t file_bytes_ RELMAP_GUARDED_BY(mutex_) = 0;  // durable bytes of the last segment
  std::uint64_t first_ RELMAP_GUARDED_BY(mutex_) = 1;
  std::uint64_t last_ RELMAP_GUARDED_BY(mutex_) = 0;
};

}  // namespace relmap::storage
