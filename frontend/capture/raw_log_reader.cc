#include "frontend/capture/raw_log_reader.h"

#include <algorithm>
#include <utility>

#include "proto/base/crc32c.h"

namespace relmap::capture {

using raw_log::Head;
using raw_log::kHeadBytes;
using raw_log::Kind;

namespace {

Status named(const LogFile& log, const Status& status) {
  return {status.reason(), log.path() + ": " + status.message()};
}

std::string what_is(const RawLogEntry& entry) {
  switch (entry.kind) {
    case Kind::kHeader:
      return "a header";
    case Kind::kFrame:
      return "frame " + std::to_string(entry.number);
    case Kind::kEvent:
      return "word of a fault";
  }
  return "a record";
}

// Reads head and body into `record`, and returns the head. IO_ERROR, CORRUPT.
Result<Head> read_record(const LogFile& log, const RawLogEntry& entry, Bytes& record) {
  record.resize(kHeadBytes + entry.bytes);
  if (Status status = log.read(entry.offset, record); !status.ok()) return status;
  const ByteSpan bytes(record);
  const auto head = raw_log::decode_head(bytes.first(kHeadBytes));
  if (!head || !entry.is_of(*head) || crc32c(bytes.subspan(kHeadBytes)) != head->crc)
    return {Reason::CORRUPT, "a record is damaged"};
  return *head;
}

// Returns the first undamaged header, or the error of the first one if both are damaged.
Result<RawLogHeader> read_header(const LogFile& log, const RawLogIndex& index) {
  Status wrong(Reason::CORRUPT, "its header is damaged");
  for (const RawLogEntry& entry : index) {
    if (entry.kind == Kind::kFrame) break;
    if (entry.kind != Kind::kHeader) continue;
    Bytes record;
    const auto head = read_record(log, entry, record);
    if (!head.ok()) continue;
    auto header = raw_log::decode_header(*head, ByteSpan(record).subspan(kHeadBytes));
    if (header.ok()) return header;
    wrong = header.status();
  }
  return wrong;
}

}  // namespace

Result<RawLogReader> RawLogReader::open(const std::string& path) {
  auto log = LogFile::open(path);
  if (!log.ok()) return log.status();
  const auto size = log->size();
  if (!size.ok()) return size.status();
  std::uint8_t begin[raw_log::kBeginBytes] = {};
  if (Status status = log->read(0, begin); status.reason() == Reason::TRUNCATED)
    return {Reason::CORRUPT, path + " is no raw log"};
  else if (!status.ok())
    return status;
  if (Status status = raw_log::check_begin(begin); !status.ok())
    return {status.reason(), path + ' ' + status.message()};
  auto index = load_raw_log_index(*log, *size);
  if (!index.ok()) return index.status();
  auto header = read_header(*log, *index);
  if (!header.ok()) return named(*log, header.status());
  return RawLogReader(std::move(*log), std::move(*header), std::move(*index), *size);
}

RawLogReader::RawLogReader(LogFile log, RawLogHeader header, RawLogIndex index, std::uint64_t size)
    : log_(std::move(log)), header_(std::move(header)), index_(std::move(index)), torn_bytes_(size - end_of(index_)) {
  for (std::size_t i = 0; i < index_.size(); ++i)
    if (index_[i].kind == Kind::kFrame) frames_.push_back(i);
}

std::size_t RawLogReader::next_frame() const {
  return static_cast<std::size_t>(std::lower_bound(frames_.begin(), frames_.end(), position_) - frames_.begin());
}

Result<std::optional<RawLogReader::Record>> RawLogReader::next() {
  while (position_ < index_.size()) {
    const RawLogEntry& entry = index_[position_];
    const std::size_t number = next_frame();
    ++position_;
    const auto refuse = [&](Reason reason, const std::string& what) -> Status {
      return {reason, path() + ", byte " + std::to_string(entry.offset) + ": " + what};
    };
    if (entry.kind == RawLogEntry::kDamage)
      return refuse(Reason::CORRUPT, std::to_string(entry.number) + " bytes are damaged, and passed over");
    const std::string what = what_is(entry);
    const auto head = read_record(log_, entry, record_);
    if (head.reason() == Reason::CORRUPT) return refuse(Reason::CORRUPT, what + " is damaged");
    if (!head.ok()) return refuse(head.reason(), what + " cannot be read: " + head.status().message());
    if (entry.kind != Kind::kFrame && entry.kind != Kind::kEvent) continue;
    const ByteSpan body = ByteSpan(record_).subspan(kHeadBytes);
    if (entry.kind == Kind::kFrame)
      return std::optional<Record>(Frame{{head->time_us, head->cycle, head->number}, number, body});
    if (head->reason == Reason::OK || !is_reason(static_cast<std::uint16_t>(head->reason)))
      return refuse(Reason::CORRUPT, "a fault of a reason that nobody knows");
    return std::optional<Record>(
        RawLogEvent{head->time_us, head->reason, std::string(body.begin(), body.end()), head->number});
  }
  return std::optional<Record>();
}

void RawLogReader::seek(std::size_t frame) { position_ = frame < frames_.size() ? frames_[frame] : index_.size(); }

void RawLogReader::skip_before(std::int64_t time_us) {
  for (std::size_t i = next_frame(); i < frames_.size() && index_[frames_[i]].time_us < time_us; ++i)
    position_ = frames_[i] + 1;
}

}  // namespace relmap::capture
