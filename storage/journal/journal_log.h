// The journal as files: journal-SEQUENCE-SALT.log, append-only segments (docs/storage-format.md). A record is durable
// when append() has returned; each carries the highest sequence that was durable before it, so that after a crash a
// damaged tail (nobody was told of it) can be told from lost records (somebody was).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/io/file.h"
#include "storage/journal/journal_segment.h"

namespace relmap::storage {

struct JournalLogOptions {
  std::uint64_t segment_bytes = std::uint64_t{16} << 20;  // a new segment is begun beyond
  bool read_only = false;                                 // nothing is repaired, nothing appended
  std::function<std::uint64_t()> salts = random_salt;     // one for each segment that is begun; tests have their own
};

// Thread-safe.
class JournalLog {
 public:
  // `applied`: records up to it are not needed any more, damaged or not, and cannot be read. Drops a damaged tail,
  // which dropped() tells. IO_ERROR, UNKNOWN_FORMAT_VERSION. Lost records do not fail it: loss() names them, reads up
  // to them succeed and appends are refused.
  static Result<std::unique_ptr<JournalLog>> open(std::shared_ptr<FileSystem> files, const std::string& directory,
                                                  std::uint64_t applied, JournalLogOptions options = {});

  // The sequence of the last one, once all are durable. On failure none of them counts, unless the machine stops before
  // the disk takes them back or the next append succeeds: then the next start may find them. The next append begins a
  // new segment, so a failure lasts as long as its cause. No records: whether some would be taken now.
  Result<std::uint64_t> append(std::span<const Bytes> records);
  Status read(std::uint64_t from, const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const;
  // Deletes the segments that hold nothing above `through`; what else is not above it can no longer be read.
  Status trim(std::uint64_t through);

  // The files that the records from first() on are in, open: what is trimmed later can still be read from them. Their
  // first `bytes` bytes are durable records.
  struct KeptFile {
    std::string name;
    std::unique_ptr<ReadFile> file;
    std::uint64_t bytes = 0;
  };
  Result<std::vector<KeptFile>> keep() const;
  Result<std::uint64_t> bytes() const;  // of those files

  std::uint64_t first() const;  // lowest that can be read; last() + 1 if none can
  std::uint64_t last() const;   // 0: none was ever written
  // OK, or DATA_LOSS naming the range of records that were durable once and cannot be read.
  const Status& loss() const { return loss_; }
  // What was dropped at open(), in words; empty: nothing.
  const std::string& dropped() const { return dropped_; }

 private:
  struct Segment {
    std::uint64_t first = 0;            // sequence of its first record
    std::optional<std::uint64_t> salt;  // none: of version 1
    std::string path;
  };

  // Where the records end.
  struct Tail {
    std::size_t segment = 0;
    std::uint64_t end = 0;  // offset; 0: there is none
    std::uint64_t sequence = 0;
  };

  JournalLog(std::shared_ptr<FileSystem> files, std::string directory, JournalLogOptions options)
      : files_(std::move(files)),
        directory_(std::move(directory)),
        options_(std::move(options)),
        next_salt_(options_.salts()) {}
  Status recover(std::uint64_t applied);
  Status loss(std::uint64_t durable, const Status& unreadable) const;
  Status continue_behind(const Tail& tail);
  Status begin_segment();
  Status write(std::span<const Bytes> records);
  void leave_segment();
  Segment segment(const SegmentName& name) const;

  const std::shared_ptr<FileSystem> files_;
  const std::string directory_;
  const JournalLogOptions options_;
  Status loss_;
  std::string dropped_;

  mutable std::mutex mutex_;
  std::vector<Segment> segments_;     // ascending; the last is appended to
  std::unique_ptr<AppendFile> file_;  // null: a write to the last segment has failed, or it is of version 1
  std::uint64_t next_salt_ = 0;       // of the segment that is begun next
  std::uint64_t file_bytes_ = 0;      // durable ones
  std::uint64_t first_ = 1;
  std::uint64_t last_ = 0;
};

}  // namespace relmap::storage
