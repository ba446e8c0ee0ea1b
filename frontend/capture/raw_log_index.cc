#include "frontend/capture/raw_log_index.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "proto/base/crc32c.h"

namespace relmap::capture {

using raw_log::Head;
using raw_log::kBeginBytes;
using raw_log::kHeadBytes;
using raw_log::Kind;

namespace {

constexpr std::string_view kIndexMagic = "RELMAPRI";
constexpr std::uint32_t kIndexVersion = 1;
constexpr std::size_t kBlock = std::size_t{256} << 10;

// The head of a record that ends before the log does.
std::optional<Head> whole(std::optional<Head> head, std::uint64_t offset, std::uint64_t size) {
  if (head && head->bytes > size - offset - kHeadBytes) head.reset();
  return head;
}

Result<std::optional<Head>> head_at(const LogFile& log, std::uint64_t offset, std::uint64_t size) {
  std::uint8_t bytes[kHeadBytes];
  if (offset > size || size - offset < kHeadBytes) return std::optional<Head>();
  if (Status status = log.read(offset, bytes); !status.ok()) return status;
  return whole(raw_log::decode_head(bytes), offset, size);
}

// The first whole record that begins at `offset` or after it; `size` if there is none.
Result<std::uint64_t> find_record(const LogFile& log, std::uint64_t offset, std::uint64_t size) {
  Bytes block;
  while (offset < size && size - offset >= kHeadBytes) {
    block.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, size - offset)));
    if (Status status = log.read(offset, block); !status.ok()) return status;
    const ByteSpan bytes(block);
    for (std::size_t at = raw_log::find_sync(bytes, 0); at + kHeadBytes <= bytes.size();
         at = raw_log::find_sync(bytes, at + 1))
      if (whole(raw_log::decode_head(bytes.subspan(at, kHeadBytes)), offset + at, size)) return offset + at;
    offset += block.size() - (kHeadBytes - 1);
  }
  return size;
}

// Whether the index belongs to the log: compares its first record, which differs between logs, and its last.
Result<bool> holds(const RawLogIndex& index, const LogFile& log, std::uint64_t size) {
  const auto is_record = [](const RawLogEntry& entry) { return entry.kind != RawLogEntry::kDamage; };
  const auto first = std::find_if(index.begin(), index.end(), is_record);
  const auto last = std::find_if(index.rbegin(), index.rend(), is_record);
  if (first == index.end() || last != index.rbegin()) return false;
  for (const RawLogEntry& entry : {*first, *last}) {
    const auto head = head_at(log, entry.offset, size);
    if (!head.ok()) return head.status();
    if (!*head || !entry.is_of(**head)) return false;
  }
  return true;
}

// An index that is longer than the log does not belong to it.
RawLogIndex read_index(const std::string& path, std::uint64_t log_size) {
  const auto file = LogFile::open(path);
  if (!file.ok()) return {};
  const auto size = file->size();
  if (!size.ok() || *size / 2 > log_size) return {};
  Bytes bytes(static_cast<std::size_t>(*size));
  if (!file->read(0, bytes).ok()) return {};
  return parse_raw_log_index(bytes);
}

void write_index(const std::string& path, const RawLogIndex& index) {
  const std::string fresh = path + ".new";
  RawLogIndexWriter writer(fresh);
  for (const RawLogEntry& entry : index) writer.add(entry);
  std::error_code ignored;
  if (!writer.flush() || std::rename(fresh.c_str(), path.c_str()) != 0) std::filesystem::remove(fresh, ignored);
}

}  // namespace

std::string raw_log_index_path(const std::string& log) { return log + ".idx"; }

std::uint64_t end_of(const RawLogIndex& index) { return index.empty() ? kBeginBytes : index.back().end(); }

Status scan_raw_log(const LogFile& log, std::uint64_t size, RawLogIndex& index) {
  std::uint64_t offset = end_of(index);
  while (offset < size) {
    const auto head = head_at(log, offset, size);
    if (!head.ok()) return head.status();
    if (*head) {
      index.emplace_back(**head, offset);
    } else {
      const auto next = find_record(log, offset + 1, size);
      if (!next.ok()) return next.status();
      if (*next == size) break;
      RawLogEntry& damage = index.emplace_back();
      damage.offset = offset;
      damage.number = *next - offset;
    }
    offset = index.back().end();
  }
  return {};
}

RawLogIndex parse_raw_log_index(ByteSpan bytes) {
  ByteReader in(bytes);
  RawLogIndex index;
  const ByteSpan magic = in.get_bytes(kIndexMagic.size());
  if (!std::ranges::equal(magic, as_bytes(kIndexMagic)) || in.get<std::uint32_t>() != kIndexVersion) return index;
  std::uint32_t crc = 0;
  for (;;) {
    const std::size_t begin = in.position();
    RawLogEntry entry;
    entry.kind = static_cast<Kind>(in.get<std::uint32_t>());
    entry.bytes = in.get<std::uint32_t>();
    entry.offset = in.get<std::uint64_t>();
    entry.time_us = in.get<std::int64_t>();
    entry.number = in.get<std::uint64_t>();
    if (!in.ok()) break;
    crc = crc32c(bytes.subspan(begin, in.position() - begin), crc);
    if (in.get<std::uint32_t>() != crc || !in.ok()) break;
    if (entry.offset != end_of(index) || entry.end() <= entry.offset) break;
    index.push_back(entry);
  }
  return index;
}

Result<RawLogIndex> load_raw_log_index(const LogFile& log, std::uint64_t size) {
  const std::string path = raw_log_index_path(log.path());
  RawLogIndex index = read_index(path, size);
  const auto good = holds(index, log, size);
  if (!good.ok()) return good.status();
  if (!*good) index.clear();
  const std::size_t known = index.size();
  if (Status status = scan_raw_log(log, size, index); !status.ok()) return status;
  if (index.size() > known) write_index(path, index);
  return index;
}

RawLogIndexWriter::RawLogIndexWriter(const std::string& path) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  auto file = LogFile::create(path);
  if (file.ok()) file_.emplace(std::move(*file));
  pending_.put_bytes(as_bytes(kIndexMagic));
  pending_.put(kIndexVersion);
}

void RawLogIndexWriter::add(const RawLogEntry& entry) {
  if (!file_) return;
  const std::size_t begin = pending_.size();
  pending_.put(static_cast<std::uint32_t>(entry.kind));
  pending_.put(entry.bytes);
  pending_.put(entry.offset);
  pending_.put(entry.time_us);
  pending_.put(entry.number);
  crc_ = crc32c(ByteSpan(pending_.bytes()).subspan(begin), crc_);
  pending_.put(crc_);
}

bool RawLogIndexWriter::flush() {
  if (file_ && !file_->append(pending_.take()).ok()) file_.reset();
  return file_.has_value();
}

}  // namespace relmap::capture
