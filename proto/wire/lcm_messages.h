// LCM messages as plain values. Encoding goes through the generated types; decoding does not: their decoders believe
// every count that they read, and a hundred bytes from anybody would take gigabytes.
#pragma once

#include <string>

#include "proto/keyframe/ingest_messages.h"

namespace relmap {

// CORRUPT (not exactly one message of this kind, or a number out of range), UNKNOWN_PROTOCOL_VERSION.
Result<KeyframePart> decode_lcm_part(ByteSpan message);
Result<Gap> decode_lcm_gap(ByteSpan message);
Result<SessionEnd> decode_lcm_end(ByteSpan message);
Result<Acknowledgement> decode_lcm_acknowledgement(ByteSpan message);
// Also BAD_ROTATION, NOT_FINITE and what else check_covariance() finds.
Result<PoseNews> decode_lcm_pose(ByteSpan message);
Result<DaemonIdentity> decode_lcm_map(ByteSpan message);

Bytes encode_lcm(const KeyframePart& part);
Bytes encode_lcm(const Gap& gap);
Bytes encode_lcm(const SessionEnd& end);
Bytes encode_lcm(const Acknowledgement& ack);
Bytes encode_lcm(const PoseNews& news);
Bytes encode_lcm(const DaemonIdentity& daemon);

// Channel RELMAP_STATUS, once a second.
struct DaemonStatus {
  BootId boot{};
  std::string version;
  std::int64_t time_us = 0;
  std::int64_t uptime_us = 0;
  std::uint64_t sessions = 0, keyframes = 0, refused = 0, closures_accepted = 0;
  std::uint64_t durable_sequence = 0, applied_sequence = 0;
  std::uint64_t memory_used = 0, memory_budget = 0;
  Reason reason = Reason::OK;  // why nothing is taken in
};
Bytes encode_lcm(const DaemonStatus& status);

}  // namespace relmap
