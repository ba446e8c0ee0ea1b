// LCM messages as plain values. Encoding uses the generated types. Decoding does not: the generated decoders trust
// every count, so a hundred bytes from anybody could make them allocate gigabytes.
#pragma once

#include <string>

#include "proto/keyframe/ingest_messages.h"

namespace relmap {

// CORRUPT (the bytes are not exactly one message of this type, or a number is out of range), UNKNOWN_PROTOCOL_VERSION.
Result<KeyframePart> decode_lcm_part(ByteSpan message);
Result<Gap> decode_lcm_gap(ByteSpan message);
Result<SessionEnd> decode_lcm_end(ByteSpan message);
Result<Acknowledgement> decode_lcm_acknowledgement(ByteSpan message);
// Also BAD_ROTATION, NOT_FINITE, and what check_covariance() answers.
Result<PoseNews> decode_lcm_pose(ByteSpan message);
Result<DaemonIdentity> decode_lcm_map(ByteSpan message);

// A robot asks who listens; see hello_t.
struct Hello {
  SessionUuid session;
};
Result<Hello> decode_lcm_hello(ByteSpan message);

Bytes encode_lcm(const KeyframePart& part);
Bytes encode_lcm(const Gap& gap);
Bytes encode_lcm(const SessionEnd& end);
Bytes encode_lcm(const Acknowledgement& ack);
Bytes encode_lcm(const PoseNews& news);
Bytes encode_lcm(const DaemonIdentity& daemon);
Bytes encode_lcm(const Hello& hello);

// Channel RELMAP_STATUS, once a second.
struct DaemonStatus {
  BootId boot{};
  std::string version;
  std::int64_t time_us = 0;
  std::int64_t uptime_us = 0;
  std::uint64_t sessions = 0, keyframes = 0, refused = 0, closures_accepted = 0;
  std::uint64_t durable_sequence = 0, applied_sequence = 0;
  std::uint64_t memory_used = 0, memory_budget = 0;
  Reason reason = Reason::OK;  // not OK: why the daemon accepts nothing
};
Bytes encode_lcm(const DaemonStatus& status);

}  // namespace relmap
