#include "proto/wire/lcm_messages.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "proto/wire/channels.h"
#include "proto/wire/convert_lcm.h"
#include "relmap_lcm/acknowledgement_t.hpp"
#include "relmap_lcm/gap_t.hpp"
#include "relmap_lcm/hello_t.hpp"
#include "relmap_lcm/keyframe_part_t.hpp"
#include "relmap_lcm/map_identity_t.hpp"
#include "relmap_lcm/pose_t.hpp"
#include "relmap_lcm/session_end_t.hpp"
#include "relmap_lcm/status_t.hpp"

namespace relmap {

namespace {

// Reads LCM's big-endian numbers. Like ByteReader, it is not ok() any more once it was asked for more bytes than there
// are, or a number was out of range.
class LcmReader {
 public:
  explicit LcmReader(ByteSpan bytes) : in_(bytes) {}

  std::uint64_t unsigned_of(std::size_t bytes) {
    std::uint64_t value = 0;
    for (const std::uint8_t b : in_.get_bytes(bytes)) value = value << 8 | b;
    return value;
  }
  std::int16_t i16() { return static_cast<std::int16_t>(unsigned_of(2)); }
  std::int64_t i64() { return static_cast<std::int64_t>(unsigned_of(8)); }
  double f64() { return std::bit_cast<double>(unsigned_of(8)); }
  // An int64_t whose value must fit a uint32.
  std::uint32_t u32_of_i64() { return narrow(unsigned_of(8)); }
  // An int32_t that must not be negative.
  std::uint32_t count() {
    const std::uint64_t value = unsigned_of(4);
    if (value > std::numeric_limits<std::int32_t>::max()) good_ = false;
    return static_cast<std::uint32_t>(value);
  }
  // A count, at most `limit`, of items of at least `size` bytes each that follow; 0 if it is out of range.
  std::uint32_t count_of(std::size_t size, std::size_t limit) {
    const std::uint32_t value = count();
    if (value > limit || !in_.fits(value, size)) good_ = false;
    return good_ ? value : 0;
  }
  template <std::size_t N>
  void array(std::array<std::uint8_t, N>& bytes) {
    in_.get_array(bytes.data(), N);
  }
  ByteSpan bytes(std::size_t n) { return in_.get_bytes(n); }
  Reason reason() {
    const std::uint32_t value = count();
    if (value > 0xffff || !is_reason(static_cast<std::uint16_t>(value))) {
      good_ = false;
      return Reason::INTERNAL;
    }
    return static_cast<Reason>(value);
  }
  bool at_end() const { return good_ && in_.at_end(); }

  // Reads fingerprint and version; not OK if the message is of another type or protocol version.
  Status begin(std::int64_t fingerprint) {
    if (unsigned_of(8) != static_cast<std::uint64_t>(fingerprint))
      return {Reason::CORRUPT, "no message of the type of its channel"};
    const std::int16_t major = i16();
    (void)i16();
    if (major != kProtocolMajor)
      return {Reason::UNKNOWN_PROTOCOL_VERSION,
              "protocol " + std::to_string(major) + "; known: " + std::to_string(kProtocolMajor)};
    return {};
  }

 private:
  std::uint32_t narrow(std::uint64_t value) {
    if (value > std::numeric_limits<std::uint32_t>::max()) good_ = false;
    return static_cast<std::uint32_t>(value);
  }

  ByteReader in_;
  bool good_ = true;
};

Status malformed(const char* what) { return {Reason::CORRUPT, std::string("malformed ") + what}; }

std::vector<SequenceRange> read_ranges(LcmReader& in) {
  std::vector<SequenceRange> ranges(in.count_of(16, kMaxAckRanges));
  for (SequenceRange& r : ranges) r = {in.u32_of_i64(), in.u32_of_i64()};
  return ranges;
}

template <typename Message>
Bytes encode(Message& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  bytes.resize(static_cast<std::size_t>(std::max(0, message.encode(bytes.data(), 0, static_cast<int>(bytes.size())))));
  return bytes;
}

template <typename Message>
void put_version(Message& message) {
  message.protocol_major = kProtocolMajor;
  message.protocol_minor = kProtocolMinor;
}

template <std::size_t N>
void put_array(const std::array<std::uint8_t, N>& from, std::uint8_t (&to)[N]) {
  std::copy(from.begin(), from.end(), to);
}

std::vector<relmap_lcm::sequence_range_t> to_lcm(const std::vector<SequenceRange>& ranges) {
  std::vector<relmap_lcm::sequence_range_t> out(ranges.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    out[i].first = ranges[i].from;
    out[i].last = ranges[i].to;
  }
  return out;
}

}  // namespace

Result<KeyframePart> decode_lcm_part(ByteSpan message) {
  LcmReader in(message);
  if (Status s = in.begin(relmap_lcm::keyframe_part_t::getHash()); !s.ok()) return s;
  KeyframePart part;
  in.array(part.session.bytes);
  part.sequence = in.u32_of_i64();
  part.part = in.count();
  part.parts = in.count();
  part.total_bytes = in.count();
  part.offset = in.count();
  part.payload_crc = in.u32_of_i64();
  part.part_crc = in.u32_of_i64();
  const ByteSpan data = in.bytes(in.count_of(1, kMaxPartBytes));
  if (!in.at_end()) return malformed("part of a keyframe");
  part.data.assign(data.begin(), data.end());
  return part;
}

Result<Gap> decode_lcm_gap(ByteSpan message) {
  LcmReader in(message);
  if (Status s = in.begin(relmap_lcm::gap_t::getHash()); !s.ok()) return s;
  Gap gap;
  in.array(gap.session.bytes);
  gap.from = in.u32_of_i64();
  gap.to = in.u32_of_i64();
  gap.reason = in.reason();
  if (!in.at_end()) return malformed("gap");
  return gap;
}

Result<SessionEnd> decode_lcm_end(ByteSpan message) {
  LcmReader in(message);
  if (Status s = in.begin(relmap_lcm::session_end_t::getHash()); !s.ok()) return s;
  SessionEnd end;
  in.array(end.session.bytes);
  end.next_sequence = in.unsigned_of(8);
  if (!in.at_end() || end.next_sequence > std::uint64_t{1} << 32) return malformed("end of a session");
  return end;
}

Result<Acknowledgement> decode_lcm_acknowledgement(ByteSpan message) {
  LcmReader in(message);
  if (Status s = in.begin(relmap_lcm::acknowledgement_t::getHash()); !s.ok()) return s;
  Acknowledgement ack;
  in.array(ack.session.bytes);
  in.array(ack.boot);
  ack.next_sequence = in.unsigned_of(8);
  ack.held = read_ranges(in);
  ack.missing = read_ranges(in);
  ack.incomplete.resize(in.count_of(20, kMaxAckIncomplete));
  for (MissingParts& missing : ack.incomplete) {
    missing.sequence = in.u32_of_i64();
    missing.payload_crc = in.u32_of_i64();
    missing.parts.resize(in.count_of(4, kMaxAckParts));
    for (std::uint32_t& part : missing.parts) part = in.count();
  }
  ack.refused.resize(in.count_of(20, kMaxAckRefused));
  for (Refused& refused : ack.refused) refused = {in.u32_of_i64(), in.u32_of_i64(), in.reason()};
  ack.credits = in.count();
  if (!in.at_end() || ack.next_sequence > std::uint64_t{1} << 32) return malformed("acknowledgement");
  return ack;
}

Result<PoseNews> decode_lcm_pose(ByteSpan bytes) {
  LcmReader in(bytes);
  if (Status s = in.begin(relmap_lcm::pose_t::getHash()); !s.ok()) return s;
  PoseNews news;
  in.array(news.boot);
  in.array(news.session.bytes);
  const std::uint64_t kind = in.unsigned_of(1);
  news.kind = static_cast<PoseNews::Kind>(kind);
  news.time_us = in.i64();
  news.keyframe.session = in.u32_of_i64();
  news.keyframe.index = in.u32_of_i64();
  news.frame.session = in.u32_of_i64();
  news.frame.index = in.u32_of_i64();
  relmap_lcm::pose_t geometry;
  for (double& value : geometry.rotation) value = in.f64();
  for (double& value : geometry.translation) value = in.f64();
  for (double& value : geometry.covariance) value = in.f64();
  news.rate_hz = in.f64();
  const bool known = kind >= static_cast<std::uint64_t>(PoseNews::Kind::kLocalised) &&
                     kind <= static_cast<std::uint64_t>(PoseNews::Kind::kEnded);
  if (!in.at_end() || !known || !(news.rate_hz >= 0)) return malformed("pose");
  if (!news.of_frame()) return news;
  const auto pose = get_pose(geometry);
  if (!pose.ok()) return pose.status();
  news.T_frame_keyframe = pose->T_frame_keyframe;
  news.covariance = pose->covariance;
  return news;
}

Result<DaemonIdentity> decode_lcm_map(ByteSpan message) {
  LcmReader in(message);
  if (Status s = in.begin(relmap_lcm::map_identity_t::getHash()); !s.ok()) return s;
  DaemonIdentity daemon;
  in.array(daemon.boot);
  in.array(daemon.map.uuid.bytes);
  daemon.map.epoch = in.unsigned_of(8);
  if (!in.at_end()) return malformed("identity of a map");
  return daemon;
}

Result<Hello> decode_lcm_hello(ByteSpan message) {
  LcmReader in(message);
  if (Status s = in.begin(relmap_lcm::hello_t::getHash()); !s.ok()) return s;
  Hello hello;
  in.array(hello.session.bytes);
  if (!in.at_end()) return malformed("hello");
  return hello;
}

Bytes encode_lcm(const KeyframePart& part) {
  relmap_lcm::keyframe_part_t message;
  put_version(message);
  put_array(part.session.bytes, message.session_uuid);
  message.sequence = part.sequence;
  message.part = static_cast<std::int32_t>(part.part);
  message.parts = static_cast<std::int32_t>(part.parts);
  message.total_size = static_cast<std::int32_t>(part.total_bytes);
  message.offset = static_cast<std::int32_t>(part.offset);
  message.payload_crc32c = part.payload_crc;
  message.part_crc32c = part.part_crc;
  message.size = static_cast<std::int32_t>(part.data.size());
  message.data = part.data;
  return encode(message);
}

Bytes encode_lcm(const Gap& gap) {
  relmap_lcm::gap_t message;
  put_version(message);
  put_array(gap.session.bytes, message.session_uuid);
  message.first = gap.from;
  message.last = gap.to;
  message.reason = static_cast<std::int32_t>(gap.reason);
  return encode(message);
}

Bytes encode_lcm(const SessionEnd& end) {
  relmap_lcm::session_end_t message;
  put_version(message);
  put_array(end.session.bytes, message.session_uuid);
  message.next_sequence = static_cast<std::int64_t>(end.next_sequence);
  return encode(message);
}

Bytes encode_lcm(const Acknowledgement& ack) {
  relmap_lcm::acknowledgement_t message;
  put_version(message);
  put_array(ack.session.bytes, message.session_uuid);
  put_array(ack.boot, message.daemon_boot_id);
  message.next_sequence = static_cast<std::int64_t>(ack.next_sequence);
  message.held = to_lcm(ack.held);
  message.held_count = static_cast<std::int32_t>(message.held.size());
  message.missing = to_lcm(ack.missing);
  message.missing_count = static_cast<std::int32_t>(message.missing.size());
  for (const MissingParts& from : ack.incomplete) {
    relmap_lcm::missing_parts_t& to = message.incomplete.emplace_back();
    to.sequence = from.sequence;
    to.payload_crc32c = from.payload_crc;
    to.part.assign(from.parts.begin(), from.parts.end());
    to.count = static_cast<std::int32_t>(to.part.size());
  }
  message.incomplete_count = static_cast<std::int32_t>(message.incomplete.size());
  for (const Refused& from : ack.refused) {
    relmap_lcm::refusal_t& to = message.refused.emplace_back();
    to.sequence = from.sequence;
    to.payload_crc32c = from.payload_crc;
    to.reason = static_cast<std::int32_t>(from.reason);
  }
  message.refused_count = static_cast<std::int32_t>(message.refused.size());
  message.credits = static_cast<std::int32_t>(ack.credits);
  return encode(message);
}

Bytes encode_lcm(const PoseNews& news) {
  relmap_lcm::pose_t message;
  put_version(message);
  put_array(news.boot, message.daemon_boot_id);
  put_array(news.session.bytes, message.session_uuid);
  message.kind = static_cast<std::int8_t>(news.kind);
  message.time_us = news.time_us;
  message.session = news.keyframe.session;
  message.sequence = news.keyframe.index;
  message.frame_session = news.frame.session;
  message.frame_index = news.frame.index;
  put_pose(news.T_frame_keyframe, news.covariance, message);
  message.rate_hz = news.rate_hz;
  return encode(message);
}

Bytes encode_lcm(const DaemonIdentity& daemon) {
  relmap_lcm::map_identity_t message;
  put_version(message);
  put_array(daemon.boot, message.daemon_boot_id);
  put_array(daemon.map.uuid.bytes, message.map_uuid);
  message.map_epoch = static_cast<std::int64_t>(daemon.map.epoch);
  return encode(message);
}

Bytes encode_lcm(const Hello& hello) {
  relmap_lcm::hello_t message;
  put_version(message);
  put_array(hello.session.bytes, message.session_uuid);
  return encode(message);
}

Bytes encode_lcm(const DaemonStatus& status) {
  relmap_lcm::status_t message;
  put_version(message);
  put_array(status.boot, message.daemon_boot_id);
  message.version = status.version;
  message.time_us = status.time_us;
  message.uptime_us = status.uptime_us;
  message.sessions = static_cast<std::int64_t>(status.sessions);
  message.keyframes = static_cast<std::int64_t>(status.keyframes);
  message.refused = static_cast<std::int64_t>(status.refused);
  message.closures_accepted = static_cast<std::int64_t>(status.closures_accepted);
  message.durable_sequence = static_cast<std::int64_t>(status.durable_sequence);
  message.applied_sequence = static_cast<std::int64_t>(status.applied_sequence);
  message.memory_used = static_cast<std::int64_t>(status.memory_used);
  message.memory_budget = static_cast<std::int64_t>(status.memory_budget);
  message.reason = static_cast<std::int32_t>(status.reason);
  return encode(message);
}

}  // namespace relmap
