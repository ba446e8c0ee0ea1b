#include "frontend/publishing/disk_spool.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <sstream>
#include <system_error>
#include <utility>

#include "frontend/publishing/spool_file.h"
#include "proto/base/crc32c.h"
#include "proto/keyframe/extension_codec.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::publishing {

namespace fs = std::filesystem;
using spool_file::io_error;

namespace {

constexpr std::uint32_t kSessionMagic = 0x53504c53;  // "SLPS"
constexpr std::uint32_t kSegmentMagic = 0x47504c53;  // "SLPG"
constexpr std::uint16_t kSpoolVersion = 1;           // of segments, and of a session file without extensions
constexpr std::uint16_t kSessionVersion = 2;         // of a session file with the extensions of its header
constexpr std::uint64_t kSegmentBytes = std::uint64_t{4} << 20;
constexpr std::size_t kSegmentHeader = 6;
constexpr std::size_t kRecordHeader = 8;  // u32 bytes, u32 crc
enum class RecordKind : std::uint8_t { kKeyframe = 1, kGap = 2 };

Bytes encode_session(const SessionHeader& header) {
  ByteWriter out;
  out.put(kSessionMagic);
  out.put(kSessionVersion);
  out.put_array(header.uuid.bytes.data(), header.uuid.bytes.size());
  out.put_string(header.robot);
  out.put_string(header.name);
  for (const double number : {header.camera.f, header.camera.cx, header.camera.cy, header.camera.baseline})
    out.put(number);
  out.put(static_cast<std::int32_t>(header.camera.width));
  out.put(static_cast<std::int32_t>(header.camera.height));
  out.put(static_cast<std::uint8_t>(header.oneway));
  put_extensions(out, header_extensions(header));
  out.put(crc32c(out.bytes()));
  return out.take();
}

Result<SessionHeader> decode_session(ByteSpan bytes, const std::string& path) {
  ByteReader in(bytes);
  SessionHeader header;
  if (in.get<std::uint32_t>() != kSessionMagic) return {Reason::CORRUPT, path + " is no session of a spool"};
  const auto version = in.get<std::uint16_t>();
  if (version < kSpoolVersion || version > kSessionVersion) return {Reason::UNKNOWN_FORMAT_VERSION, path};
  in.get_array(header.uuid.bytes.data(), header.uuid.bytes.size());
  header.robot = in.get_string();
  header.name = in.get_string();
  for (double* number : {&header.camera.f, &header.camera.cx, &header.camera.cy, &header.camera.baseline})
    *number = in.get<double>();
  header.camera.width = in.get<std::int32_t>();
  header.camera.height = in.get<std::int32_t>();
  header.oneway = in.get<std::uint8_t>() != 0;
  const bool understood = version < kSessionVersion || set_header_extensions(header, get_extensions(in));
  const std::uint32_t crc = in.get<std::uint32_t>();
  if (!in.at_end() || crc != crc32c(bytes.first(bytes.size() - sizeof crc)))
    return {Reason::CORRUPT, path + " fails its checksum"};
  if (!understood) return {Reason::CORRUPT, path + " holds a malformed calibration"};
  return header;
}

}  // namespace

Result<std::unique_ptr<DiskSpool>> DiskSpool::open(const std::string& folder, SessionHeader header,
                                                   const std::string& recording) {
  if (Status made = spool_file::create_folder(folder); !made.ok()) return made;
  const std::string lock_path = folder + "/lock";
  const int lock = ::open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, spool_file::kOwnerOnly);
  if (lock < 0) return io_error("open", lock_path);
  std::unique_ptr<DiskSpool> spool(new DiskSpool(folder, lock));
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0)
    return {Reason::FOLDER_LOCKED, "another front-end holds the spool in " + folder};
  if (Status s = spool->find_segments(); !s.ok()) return s;
  if (Status s = spool->load_session(std::move(header)); !s.ok()) return s;
  if (Status s = spool->load_recording(recording); !s.ok()) return s;
  if (Status s = spool->load_map(); !s.ok()) return s;
  for (auto& [number, segment] : spool->segments_)
    if (Status s = spool->load_segment(number); !s.ok()) return s;
  return spool;
}

DiskSpool::~DiskSpool() {
  if (file_ >= 0) ::close(file_);
  ::close(lock_);
}

Status DiskSpool::load_session(SessionHeader header) {
  const std::string path = folder_ + "/session";
  if (segments_.empty() || !fs::exists(path)) {  // a spool that never held anything belongs to no session
    if (header.uuid.is_nil()) header.uuid = SessionUuid::random();
    session_ = std::move(header);
    return spool_file::replace(folder_, "session", encode_session(session_));
  }
  const Result<Bytes> bytes = spool_file::read_all(path);
  if (!bytes.ok()) return bytes.status();
  Result<SessionHeader> stored = decode_session(*bytes, path);
  if (!stored.ok()) return stored.status();
  if (!same_camera(*stored, header))
    return {Reason::CALIBRATION_CHANGED, "the session in " + folder_ + " began with another camera or flags"};
  if (stored->robot != header.robot || stored->name != header.name ||
      (!header.uuid.is_nil() && stored->uuid != header.uuid))
    return {Reason::INVALID_ARGUMENT, folder_ + " holds session '" + stored->name + "' of robot '" + stored->robot +
                                          "', " + stored->uuid.to_string()};
  session_ = std::move(*stored);
  return {};
}

Status DiskSpool::load_recording(const std::string& recording) {
  if (recording.empty()) return {};
  const std::string path = folder_ + "/recording";
  if (segments_.empty() || !fs::exists(path)) return spool_file::replace(folder_, "recording", as_bytes(recording));
  const Result<Bytes> bytes = spool_file::read_all(path);
  if (!bytes.ok()) return bytes.status();
  const std::string stored(bytes->begin(), bytes->end());
  if (stored == recording) return {};
  return {Reason::INVALID_ARGUMENT, "session '" + session_.name + "' of robot '" + session_.robot + "' in " + folder_ +
                                        " is another recording, or was begun with other options: " + stored +
                                        "; this is " + recording +
                                        ". Go on with the same --every, --all-keyframes and --picture, or name a "
                                        "session of its own"};
}

Status DiskSpool::load_map() {
  const std::string path = folder_ + "/map";
  if (segments_.empty()) return forget({"map", "unrepeatable"});
  unrepeatable_ = fs::exists(folder_ + "/unrepeatable");
  if (!fs::exists(path)) return {};
  const Result<Bytes> bytes = spool_file::read_all(path);
  if (!bytes.ok()) return bytes.status();
  std::istringstream line(std::string(bytes->begin(), bytes->end()));
  std::string uuid;
  std::uint64_t epoch = 0;
  line >> uuid >> epoch;
  const auto parsed = Uuid::parse(uuid);
  if (!line || !parsed || parsed->is_nil()) return {Reason::CORRUPT, path + " names no map"};
  map_ = {*parsed, epoch};
  return {};
}

Status DiskSpool::set_map(const MapIdentity& map) {
  const std::string line = map.uuid.to_string() + " " + std::to_string(map.epoch) + "\n";
  if (Status s = spool_file::replace(folder_, "map", as_bytes(line)); !s.ok()) return s;
  map_ = map;
  return {};
}

Status DiskSpool::forget(std::initializer_list<const char*> names) {
  for (const char* name : names) {
    std::error_code error;
    fs::remove(folder_ + "/" + name, error);
    if (error) return {Reason::IO_ERROR, "remove " + folder_ + "/" + name + ": " + error.message()};
  }
  return {};
}

Status DiskSpool::mark_unrepeatable() {
  if (unrepeatable_) return {};
  Status marked = spool_file::replace(folder_, "unrepeatable", {});
  unrepeatable_ = marked.ok();
  return marked;
}

// The map is deleted last, since until then what is left belongs to it. An empty segment is left, so that the folder
// still belongs to the session.
Status DiskSpool::begin_anew() {
  if (unrepeatable_) {
    session_.uuid = SessionUuid::random();
    if (Status s = spool_file::replace(folder_, "session", encode_session(session_)); !s.ok()) return s;
  }
  if (file_ >= 0) ::close(file_);
  file_ = -1;
  for (const auto& [number, segment] : segments_)
    if (::unlink(segment_path(number).c_str()) != 0) return io_error("remove", segment_path(number));
  segments_.clear();
  if (Status s = open_segment(); !s.ok()) return s;
  if (Status s = forget({"unrepeatable", "map"}); !s.ok()) return s;
  keyframes_.clear();
  places_.clear();
  gaps_.clear();
  map_ = {};
  unrepeatable_ = false;
  return spool_file::sync_folder(folder_);
}

std::string DiskSpool::segment_path(std::uint32_t number) const {
  char name[32];
  std::snprintf(name, sizeof name, "/%010u.seg", number);
  return folder_ + name;
}

Status DiskSpool::find_segments() {
  std::error_code error;
  for (const fs::directory_entry& file : fs::directory_iterator(folder_, error)) {
    const std::string name = file.path().filename().string();
    if (name.size() != 14 || !name.ends_with(".seg") || name.find_first_not_of("0123456789") != 10) continue;
    // A file with a larger number is none of ours: after it there would be no next one.
    if (const unsigned long number = std::stoul(name); number < std::numeric_limits<std::uint32_t>::max())
      segments_.emplace(static_cast<std::uint32_t>(number), Segment{});
  }
  if (error) return {Reason::IO_ERROR, "list " + folder_ + ": " + error.message()};
  return {};
}

Status DiskSpool::load_segment(std::uint32_t number) {
  const Result<Bytes> bytes = spool_file::read_all(segment_path(number));
  if (!bytes.ok()) return bytes.status();
  Segment& segment = segments_.at(number);
  segment.bytes = bytes->size();
  ByteReader in(*bytes);
  const bool known = in.get<std::uint32_t>() == kSegmentMagic && in.get<std::uint16_t>() == kSpoolVersion;
  std::size_t good = 0;
  while (known && in.ok()) {
    good = in.position();
    const auto size = in.get<std::uint32_t>();
    const auto crc = in.get<std::uint32_t>();
    const ByteSpan record = in.get_bytes(size);
    if (!in.ok() || crc32c(record) != crc) break;
    ByteReader body(record);
    const auto kind = body.get<RecordKind>();
    if (kind == RecordKind::kKeyframe) {
      const auto sequence = body.get<std::uint32_t>();
      if (!body.ok()) break;
      const auto payload_bytes = static_cast<std::uint32_t>(body.remaining());
      const std::uint64_t offset = in.position() - payload_bytes;
      keyframes_[sequence] = {crc32c(body.get_bytes(payload_bytes)), payload_bytes};
      places_[sequence] = {number, offset};
      segment.end = std::max(segment.end, sequence + std::uint64_t{1});
    } else if (kind == RecordKind::kGap) {
      Gap gap{session_.uuid, body.get<std::uint32_t>(), body.get<std::uint32_t>(), body.get<Reason>()};
      if (!body.ok()) break;
      gaps_.push_back(gap);
      segment.end = std::max(segment.end, gap.to + std::uint64_t{1});
    }
  }
  damaged_bytes_ += bytes->size() - good;
  return {};
}

std::uint64_t DiskSpool::disk_bytes() const {
  std::uint64_t total = 0;
  for (const auto& [number, segment] : segments_) total += segment.bytes;
  return total;
}

// A process never appends to a segment of another process, which may end in the middle of a record.
Status DiskSpool::open_segment() {
  if (file_ >= 0) ::close(file_);
  const std::uint32_t number = segments_.empty() ? 0 : segments_.rbegin()->first + 1;
  const std::string path = segment_path(number);
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, spool_file::kOwnerOnly);
  if (file_ < 0) return io_error("create", path);
  segments_.emplace(number, Segment{});
  ByteWriter header;
  header.put(kSegmentMagic);
  header.put(kSpoolVersion);
  if (Status s = spool_file::write_all(file_, header.bytes(), path); !s.ok()) return s;
  segments_.rbegin()->second.bytes = kSegmentHeader;
  return spool_file::sync_folder(folder_);
}

Status DiskSpool::append_record(ByteSpan head, ByteSpan body, std::uint64_t end) {
  if (file_ < 0 || segments_.rbegin()->second.bytes >= kSegmentBytes)
    if (Status s = open_segment(); !s.ok()) return s;
  ByteWriter record;
  record.reserve(kRecordHeader + head.size() + body.size());
  record.put(static_cast<std::uint32_t>(head.size() + body.size()));
  record.put(crc32c(body, crc32c(head)));
  record.put_bytes(head);
  record.put_bytes(body);
  auto& [number, segment] = *segments_.rbegin();
  const std::string path = segment_path(number);
  Status s = spool_file::write_all(file_, record.bytes(), path);
  if (s.ok() && ::fdatasync(file_) != 0) s = io_error("sync", path);
  if (!s.ok()) {  // nothing may follow half a record
    ::close(file_);
    file_ = -1;
    return s;
  }
  segment.bytes += record.size();
  segment.end = std::max(segment.end, end);
  return {};
}

Status DiskSpool::append(std::uint32_t sequence, ByteSpan payload, std::uint32_t crc) {
  ByteWriter head;
  head.put(RecordKind::kKeyframe);
  head.put(sequence);
  if (Status s = append_record(head.bytes(), payload, sequence + std::uint64_t{1}); !s.ok()) return s;
  const auto& [number, segment] = *segments_.rbegin();
  keyframes_[sequence] = {crc, static_cast<std::uint32_t>(payload.size())};
  places_[sequence] = {number, segment.bytes - payload.size()};
  return {};
}

Status DiskSpool::append_gap(const Gap& gap) {
  ByteWriter head;
  head.put(RecordKind::kGap);
  head.put(gap.from);
  head.put(gap.to);
  head.put(gap.reason);
  if (Status s = append_record(head.bytes(), {}, gap.to + std::uint64_t{1}); !s.ok()) return s;
  gaps_.push_back(gap);
  return {};
}

Result<Bytes> DiskSpool::read(std::uint32_t sequence) const {
  const auto it = keyframes_.find(sequence);
  if (it == keyframes_.end()) return {Reason::NO_SUCH_FRAME, "no keyframe " + std::to_string(sequence)};
  const Place& place = places_.at(sequence);
  const std::string path = segment_path(place.segment);
  Result<Bytes> bytes = spool_file::read_at(path, place.offset, it->second.bytes);
  if (bytes.ok() && crc32c(*bytes) != it->second.crc)
    return {Reason::CORRUPT, "keyframe " + std::to_string(sequence) + " in " + path + " has changed"};
  return bytes;
}

Status DiskSpool::remove_below(std::uint64_t sequence) {
  const auto last = segments_.empty() ? segments_.end() : std::prev(segments_.end());
  for (auto it = segments_.begin(); it != last;) {
    if (it->second.end > sequence) {
      ++it;
      continue;
    }
    const std::string path = segment_path(it->first);
    if (::unlink(path.c_str()) != 0) return io_error("remove", path);
    const std::uint32_t number = it->first;
    std::erase_if(keyframes_, [&](const auto& entry) { return places_.at(entry.first).segment == number; });
    std::erase_if(places_, [&](const auto& entry) { return entry.second.segment == number; });
    it = segments_.erase(it);
  }
  std::erase_if(gaps_, [&](const Gap& gap) { return gap.to < sequence; });
  return {};
}

}  // namespace relmap::publishing
