#include "storage/journal/journal_log.h"

#include <algorithm>

#include "proto/base/mutex.h"

namespace relmap::storage {
namespace {

std::string range(std::uint64_t from, std::uint64_t to) { return std::to_string(from) + ".." + std::to_string(to); }

}  // namespace

JournalLog::Segment JournalLog::segment(const SegmentName& name) const {
  return {name.first, name.salt, directory_ + "/" + name.to_string()};
}

Result<std::unique_ptr<JournalLog>> JournalLog::open(std::shared_ptr<FileSystem> files, const std::string& directory,
                                                     std::uint64_t applied, JournalLogOptions options) {
  std::unique_ptr<JournalLog> log(new JournalLog(std::move(files), directory, std::move(options)));
  if (!log->options_.read_only) {
    if (Status made = create_durable_directory(*log->files_, directory); !made.ok()) return made;
  }
  {
    const MutexLock lock(log->mutex_);
    if (Status recovered = log->recover(applied); !recovered.ok()) return recovered;
  }
  return log;
}

// Reads every record that may be needed. Those from applied + 1 on must follow each other without a gap. Behind the
// first gap, the rest is lost if anything says that it was durable, or if it cannot be read; otherwise it is the tail
// that a crash cut off.
Status JournalLog::recover(std::uint64_t applied) {
  const auto names = files_->list(directory_);
  if (!names.ok()) return names.status();
  for (const std::string& name : *names)
    if (const auto parsed = SegmentName::parse(name)) segments_.push_back(segment(*parsed));

  last_ = applied;
  first_ = applied + 1;
  std::uint64_t durable = applied;
  std::uint64_t previous = 0;  // sequence of the record before
  Tail tail;
  bool more = false;  // there are bytes behind `tail`
  Status unreadable;
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const std::uint64_t limit = i + 1 < segments_.size() ? segments_[i + 1].first : ~std::uint64_t{0};
    if (limit <= applied + 1) continue;
    durable = std::max(durable, segments_[i].first - 1);  // a segment is begun when all before it is durable
    const auto reader = SegmentReader::open(*files_, segments_[i].path);
    if (reader.reason() == Reason::UNKNOWN_FORMAT_VERSION) return reader.status();
    more = true;
    if (!reader.ok()) {
      unreadable = reader.status();
      continue;
    }
    if (reader->header_whole() && segments_[i].first == last_ + 1)
      tail = {i, reader->first_offset(), last_}, more = false;
    previous = std::max(previous, segments_[i].first - 1);  // find_after() looks no further ahead than 2^24 records
    for (std::uint64_t offset = reader->first_offset();;) {
      auto record = reader->record_at(offset);
      if (record.ok() && !*record) record = reader->find_after(offset, previous);
      if (!record.ok()) unreadable = record.status();
      more = more || offset < reader->size();
      if (!record.ok() || !*record || (*record)->sequence >= limit) break;
      const SegmentRecord& found = **record;
      durable = std::max(durable, found.acknowledged_through);
      if (found.sequence <= applied + 1 || found.sequence == last_ + 1) {
        last_ = std::max(last_, found.sequence);
        tail = {i, found.end, found.sequence};
        more = false;
      }
      previous = found.sequence;
      offset = found.end;
    }
  }
  loss_ = loss(durable, unreadable);
  if (loss_.ok() && more)
    dropped_ = "journal records from " + std::to_string(last_ + 1) + " on were cut off; they had not been acknowledged";
  return options_.read_only || !loss_.ok() ? Status() : continue_behind(tail);
}

// DATA_LOSS if records behind last_ are missing that were durable (`durable`: the highest such sequence known), or if
// files there cannot be read (`unreadable`: why).
Status JournalLog::loss(std::uint64_t durable, const Status& unreadable) const {
  if (!unreadable.ok() && durable <= last_)
    return Status(Reason::DATA_LOSS,
                  "journal records from " + std::to_string(last_ + 1) + " on cannot be read: " + unreadable.message());
  if (durable <= last_) return {};
  std::string why = directory_ + " holds none of them";
  for (const Segment& segment : segments_)
    if (segment.first <= last_ + 1) why = segment.path + " is damaged there";
  if (!unreadable.ok()) why = unreadable.message();
  return Status(Reason::DATA_LOSS,
                "journal records " + range(last_ + 1, durable) + " were durable and cannot be read: " + why);
}

// Removes what stands behind the tail, and opens the tail's segment for appending.
Status JournalLog::continue_behind(const Tail& tail) {
  const bool usable = tail.end != 0 && tail.sequence == last_;
  while (!segments_.empty() && (!usable || segments_.size() > tail.segment + 1)) {
    if (Status removed = files_->remove(segments_.back().path); !removed.ok()) return removed;
    segments_.pop_back();
  }
  // If a removed segment came back, its records would count instead of those that are written next.
  if (Status synced = files_->sync_directory(directory_); !synced.ok()) return synced;
  if (segments_.empty()) return begin_segment();
  const std::string& path = segments_.back().path;
  const auto reader = files_->open_read(path);
  if (!reader.ok()) return reader.status();
  if ((*reader)->size() > tail.end) {
    if (Status cut = files_->truncate(path, tail.end); !cut.ok()) return cut;
  }
  auto file = files_->open_append(path);
  if (!file.ok()) return file.status();
  // After a kill, what was read may have been in the page cache only.
  if (Status synced = (*file)->sync(); !synced.ok()) return synced;
  if (segments_.back().salt) file_ = std::move(*file);  // otherwise the next append begins a new segment
  file_bytes_ = tail.end;
  return {};
}

// Files that a failed segment with this first sequence left are removed first, whatever their salt: their syncs cannot
// be trusted.
Status JournalLog::begin_segment() {
  const Segment begun = segment({last_ + 1, next_salt_});
  const Bytes header = segment_header(begun.first, next_salt_);
  const auto remove = [&](const std::string& path) -> Status {
    const Status removed = files_->remove(path);
    return removed.reason() == Reason::NO_SUCH_FILE ? Status() : removed;
  };
  const auto begin = [&]() RELMAP_REQUIRES(mutex_) -> Status {
    auto file = files_->open_append(begun.path);
    if (!file.ok()) return file.status();
    if (Status status = (*file)->append(header); !status.ok()) return status;
    if (Status status = (*file)->sync(); !status.ok()) return status;
    if (Status status = files_->sync_directory(directory_); !status.ok()) return status;
    segments_.push_back(begun);  // before the file, so that records have its salt
    file_ = std::move(*file);
    return {};
  };
  if (Status removed = remove(begun.path); !removed.ok()) return removed;
  for (; !segments_.empty() && segments_.back().first == begun.first; segments_.pop_back())
    if (Status removed = remove(segments_.back().path); !removed.ok()) return removed;
  if (Status status = begin(); !status.ok()) {
    (void)remove(begun.path);
    return status;
  }
  file_bytes_ = header.size();
  next_salt_ = options_.salts();
  return {};
}

Result<std::uint64_t> JournalLog::append(std::span<const Bytes> records) {
  const MutexLock lock(mutex_);
  if (!loss_.ok()) return loss_;
  if (options_.read_only) return Status(Reason::READ_ONLY, "the journal was opened for reading");
  for (const Bytes& record : records)
    if (record.size() > kMaxRecordBytes)
      return Status(Reason::BAD_SIZE, "a journal record of " + std::to_string(record.size()) + " bytes");
  if (!file_ || file_bytes_ >= options_.segment_bytes) {
    if (Status begun = begin_segment(); !begun.ok()) return begun;
  }
  if (records.empty()) return last_;
  Status written;
  try {
    written = write(records);
  } catch (const std::exception&) {
    written = caught_status();
  }
  if (!written.ok()) {
    leave_segment();
    return written;
  }
  return last_ += records.size();
}

// Cuts off what the failed write left, so that no later reader finds it. If that fails too, the first sequence of the
// next segment says that it does not exist.
void JournalLog::leave_segment() {
  file_.reset();
  (void)files_->truncate(segments_.back().path, file_bytes_);
}

Status JournalLog::write(std::span<const Bytes> records) {
  ByteWriter w;
  std::uint64_t sequence = last_;
  for (const Bytes& record : records) put_journal_record(w, *segments_.back().salt, ++sequence, last_, record);
  if (Status status = file_->append(w.bytes()); !status.ok()) return status;
  if (Status status = file_->sync(); !status.ok()) return status;
  file_bytes_ += w.size();
  return {};
}

Status JournalLog::read(std::uint64_t from,
                        const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const {
  std::vector<Segment> segments;
  std::uint64_t last = 0;
  {
    const MutexLock lock(mutex_);
    segments = segments_;
    last = last_;
    from = std::max(from, first_);
  }
  for (std::size_t i = 0; i < segments.size() && from <= last; ++i) {
    if (i + 1 < segments.size() && segments[i + 1].first <= from) continue;
    const auto reader = SegmentReader::open(*files_, segments[i].path);
    if (reader.reason() == Reason::NO_SUCH_FILE) continue;  // trimmed since
    if (!reader.ok()) return reader.status();
    const std::uint64_t limit = i + 1 < segments.size() ? segments[i + 1].first : last + 1;
    std::uint64_t offset = reader->first_offset();
    std::uint64_t sequence = segments[i].first;
    while (sequence < limit) {
      auto record = reader->record_at(offset);
      if (!record.ok()) return record.status();
      if (!*record) record = reader->find_after(offset, sequence - 1);  // damage below `from` does not matter
      if (!record.ok()) return record.status();
      if (!*record || ((*record)->sequence != sequence && (*record)->sequence > from))
        return Status(Reason::DATA_LOSS, "journal records from " + std::to_string(std::max(sequence, from)) +
                                             " on were durable and cannot be read");
      sequence = (*record)->sequence;
      if (sequence >= limit) break;
      if (sequence >= from && !visit(sequence, (*record)->payload)) return {};
      offset = (*record)->end;
      ++sequence;
    }
    from = std::max(from, limit);
  }
  return loss_;
}

Status JournalLog::trim(std::uint64_t through) {
  std::vector<Segment> gone;
  {
    const MutexLock lock(mutex_);
    if (options_.read_only) return Status(Reason::READ_ONLY, "the journal was opened for reading");
    first_ = std::max(first_, std::min(through, last_) + 1);
    while (segments_.size() > 1 && segments_[1].first <= through + 1) {
      gone.push_back(segments_.front());
      segments_.erase(segments_.begin());
    }
  }
  for (const Segment& segment : gone)
    if (Status removed = files_->remove(segment.path); !removed.ok() && removed.reason() != Reason::NO_SUCH_FILE)
      return removed;
  return {};
}

Status JournalLog::leave_applied() {
  std::uint64_t last = 0;
  {
    const MutexLock lock(mutex_);
    if (options_.read_only || !loss_.ok() || first_ <= last_) return {};
    if (!segments_.empty() && segments_.back().first > last_) return {};  // it holds none
    if (Status begun = begin_segment(); !begun.ok()) return begun;
    last = last_;
  }
  return trim(last);
}

Result<std::vector<JournalLog::KeptFile>> JournalLog::keep() const {
  const MutexLock lock(mutex_);
  std::vector<KeptFile> kept;
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    auto file = files_->open_read(segments_[i].path);
    if (!file.ok()) return file.status();
    const bool growing = i + 1 == segments_.size() && file_bytes_ > 0;
    const std::uint64_t bytes = growing ? file_bytes_ : (*file)->size();
    kept.push_back({segments_[i].path.substr(directory_.size() + 1), std::move(*file), bytes});
  }
  return kept;
}

Result<std::uint64_t> JournalLog::bytes() const {
  const auto kept = keep();
  if (!kept.ok()) return kept.status();
  std::uint64_t sum = 0;
  for (const KeptFile& file : *kept) sum += file.bytes;
  return sum;
}

std::uint64_t JournalLog::first() const {
  const MutexLock lock(mutex_);
  return first_;
}

std::uint64_t JournalLog::last() const {
  const MutexLock lock(mutex_);
  return last_;
}

}  // namespace relmap::storage
