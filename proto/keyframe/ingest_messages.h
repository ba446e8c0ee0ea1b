// What a front-end and the daemon say to each other while keyframes are streamed, as plain values: the same over LCM
// (proto/lcm) and gRPC (Ingest), and in tests without either. docs/protocol.md tells the whole exchange.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/ids.h"
#include "proto/base/map_identity.h"
#include "proto/base/status.h"
#include "proto/geometry/geometry.h"
#include "proto/keyframe/keyframe.h"

namespace relmap {

inline constexpr std::int16_t kStreamMajor = 1;  // another one is UNKNOWN_PROTOCOL_VERSION
inline constexpr std::int16_t kStreamMinor = 0;

inline constexpr std::uint32_t kMinPartBytes = 512;    // of payload; the last part of a keyframe may be shorter
inline constexpr std::uint32_t kMaxPartBytes = 60000;  // fits one UDP datagram: best where nothing leaves the machine
inline constexpr std::uint32_t kNetworkPartBytes = 1376;
inline constexpr std::uint32_t kMaxParts = kMaxKeyframeBytes / kMinPartBytes;

// New at every start of the daemon.
using BootId = std::array<std::uint8_t, 16>;

// What a daemon says of itself before anything else.
struct DaemonIdentity {
  BootId boot{};
  MapIdentity map;  // not known: it does not say
};

// One part of a keyframe's payload. All parts but the last have the same size, so part * size is the offset.
struct KeyframePart {
  SessionUuid session;
  std::uint32_t sequence = 0;
  std::uint32_t part = 0;  // 0 .. parts - 1
  std::uint32_t parts = 0;
  std::uint32_t total_bytes = 0;  // of the payload
  std::uint32_t offset = 0;       // of this part in it
  std::uint32_t payload_crc = 0;  // CRC32C of the payload: names this version of the keyframe
  std::uint32_t part_crc = 0;     // part_checksum()
  Bytes data;
};

// CRC32C of every field above `part_crc` and of the data, so that a part with a damaged header is no more believed
// than one with damaged data.
std::uint32_t part_checksum(const KeyframePart& part);

// BAD_SIZE, TRUNCATED or CORRUPT unless the part is one that cut_part() could have made.
Status check_part(const KeyframePart& part);

// The size of all parts of its keyframe but the last, as this part has it.
std::uint32_t regular_part_bytes(const KeyframePart& part);

// How many parts of `part_bytes` a payload has, and the index-th of them.
std::uint32_t count_parts(std::size_t payload_bytes, std::uint32_t part_bytes);
KeyframePart cut_part(const SessionUuid& session, std::uint32_t sequence, ByteSpan payload, std::uint32_t payload_crc,
                      std::uint32_t part_bytes, std::uint32_t index);

struct SequenceRange {
  std::uint32_t from = 0, to = 0;  // inclusive
  bool operator==(const SequenceRange&) const = default;
};

struct MissingParts {
  std::uint32_t sequence = 0;
  std::uint32_t payload_crc = 0;
  std::vector<std::uint32_t> parts;  // ascending; not empty
};

// In place of a sequence: the session itself takes nothing (SESSION_DELETED, SESSION_FROZEN). No keyframe has that one.
inline constexpr std::uint32_t kWholeSession = 0xffffffff;

struct Refused {
  std::uint32_t sequence = 0;
  std::uint32_t payload_crc = 0;
  Reason reason = Reason::INTERNAL;
};

// All that the daemon knows of one session, so that the newest acknowledgement suffices.
struct Acknowledgement {
  SessionUuid session;
  BootId boot{};
  // Every sequence below is settled (applied, refused or given up) and durable. It goes back only if the daemon's disk
  // lost what it had promised, or another map answers: the robot then resends from here on.
  std::uint64_t next_sequence = 0;
  std::vector<SequenceRange> held;       // at or above it, whole, waiting for their turn or for the disk; ascending
  std::vector<SequenceRange> missing;    // at or above it, nothing came although later ones did; ascending
  std::vector<MissingParts> incomplete;  // oldest first
  std::vector<Refused> refused;          // the newest refusals, ascending; that of the session, if there is one, last
  std::uint32_t credits = 0;             // send only sequences below next_sequence + credits
  SessionNumber number = 0;              // of the session in the map; 0: not begun, or not said (LCM)
};

// The session has no more keyframes for now. Repeated until PoseNews::kEnded comes; a later keyframe opens it again.
struct SessionEnd {
  SessionUuid session;
  std::uint64_t next_sequence = 0;  // everything below was pushed
};

// News of one keyframe for its robot. It is said once, and may be lost.
struct PoseNews {
  enum class Kind : std::int8_t {
    kLocalised = 1,   // found at `frame`, which awaits confirmation
    kClosure = 2,     // a loop closure to `frame` came into force
    kClosureOut = 3,  // that closure was taken out
    kSlowDown = 4,    // the daemon falls behind: at most rate_hz keyframes a second
    kResume = 5,
    kEnded = 6,  // the robot's SessionEnd is in the journal
  };
  BootId boot{};
  SessionUuid session;
  Kind kind = Kind::kLocalised;
  std::int64_t time_us = 0;  // UTC
  FrameId keyframe;          // of `session`, as the map numbers it; its index is the keyframe's sequence
  FrameId frame;             // of the map, of any session; taken in before the keyframe
  SE3 T_frame_keyframe;
  Matrix6 covariance = Matrix6::Zero();  // of xi = (rho, phi), metres and radians, in T_frame_keyframe Exp(xi)
  double rate_hz = 0;                    // kSlowDown

  // Whether frame, transform and covariance mean anything.
  bool of_frame() const { return kind < Kind::kSlowDown; }
};

inline constexpr std::size_t kMaxAckRanges = 32;      // held, and missing, each
inline constexpr std::size_t kMaxAckIncomplete = 16;  // keyframes
inline constexpr std::size_t kMaxAckParts = 128;      // of all of them
inline constexpr std::size_t kMaxAckRefused = 64;

}  // namespace relmap
