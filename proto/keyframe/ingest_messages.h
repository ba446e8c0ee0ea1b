// The messages that a front-end and the daemon exchange while keyframes are streamed, as plain values. They are the
// same over LCM (proto/lcm) and gRPC (Ingest), and in tests without either. docs/protocol.md describes the exchange.
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

inline constexpr std::int16_t kStreamMajor = 1;  // any other is refused: UNKNOWN_PROTOCOL_VERSION
inline constexpr std::int16_t kStreamMinor = 0;

inline constexpr std::uint32_t kMinPartBytes = 512;       // of payload; the last part of a keyframe may be shorter
inline constexpr std::uint32_t kMaxPartBytes = 60000;     // fits one UDP datagram: best if nothing leaves the machine
inline constexpr std::uint32_t kNetworkPartBytes = 1328;  // its datagram, sealed, fits a frame of 1500 bytes
inline constexpr std::uint32_t kMaxParts = kMaxKeyframeBytes / kMinPartBytes;

// New at every start of the daemon.
using BootId = std::array<std::uint8_t, 16>;

// What a daemon reports of itself before anything else.
struct DaemonIdentity {
  BootId boot{};
  MapIdentity map;  // not known() if the daemon does not report it
};

// One part of a keyframe's payload. All parts but the last have the same size, so part * size is the offset.
struct KeyframePart {
  SessionUuid session;
  std::uint32_t sequence = 0;
  std::uint32_t part = 0;  // 0 .. parts - 1
  std::uint32_t parts = 0;
  std::uint32_t total_bytes = 0;  // of the payload
  std::uint32_t offset = 0;       // of this part in it
  std::uint32_t payload_crc = 0;  // CRC32C of the payload: identifies this version of the keyframe
  std::uint32_t part_crc = 0;     // part_checksum()
  Bytes data;
};

// CRC32C of every field before `part_crc` and of the data, so that damage to the header is found, too.
std::uint32_t part_checksum(const KeyframePart& part);

// BAD_SIZE, TRUNCATED or CORRUPT unless cut_part() could have made this part.
Status check_part(const KeyframePart& part);

// The size of every part of the keyframe but the last, derived from this part.
std::uint32_t regular_part_bytes(const KeyframePart& part);

// Into how many parts of `part_bytes` a payload is cut.
std::uint32_t count_parts(std::size_t payload_bytes, std::uint32_t part_bytes);
// Makes part `index` of them, from 0.
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

// Stands in Refused::sequence if the session itself is refused (SESSION_DELETED, SESSION_FROZEN). No keyframe has this
// sequence.
inline constexpr std::uint32_t kWholeSession = 0xffffffff;

struct Refused {
  std::uint32_t sequence = 0;
  std::uint32_t payload_crc = 0;
  Reason reason = Reason::INTERNAL;
};

// All that the daemon knows of a session, so that a robot needs only the newest acknowledgement.
struct Acknowledgement {
  SessionUuid session;
  BootId boot{};
  // Every sequence below is settled (applied, refused or given up) and durable. It decreases only if the daemon's disk
  // lost what was settled, or a daemon with another map answers; the robot then resends from here on.
  std::uint64_t next_sequence = 0;
  std::vector<SequenceRange> held;       // at or above it, received whole but not settled yet; ascending
  std::vector<SequenceRange> missing;    // at or above it, nothing received although later ones were; ascending
  std::vector<MissingParts> incomplete;  // oldest first
  std::vector<Refused> refused;          // the newest refusals, ascending; one of the whole session is last
  std::uint32_t credits = 0;             // send only sequences below next_sequence + credits
  SessionNumber number = 0;              // of the session in the map; 0: not begun, or not reported (LCM)
};

// The session has no more keyframes for now. The robot repeats it until it receives PoseNews::kEnded. A later keyframe
// reopens the session.
struct SessionEnd {
  SessionUuid session;
  std::uint64_t next_sequence = 0;  // every sequence below was pushed or given up
};

// News of one keyframe for its robot. It is sent once and may be lost.
struct PoseNews {
  enum class Kind : std::int8_t {
    kLocalised = 1,   // found at `frame`, which awaits confirmation
    kClosure = 2,     // a loop closure to `frame` came into force
    kClosureOut = 3,  // that closure is no longer in force
    kSlowDown = 4,    // the daemon falls behind: send at most rate_hz keyframes a second
    kResume = 5,      // back to the robot's own rate
    kEnded = 6,       // the robot's SessionEnd is in the journal
  };
  BootId boot{};
  SessionUuid session;
  Kind kind = Kind::kLocalised;
  std::int64_t time_us = 0;  // UTC
  FrameId keyframe;          // its id in the map; the index is the keyframe's sequence
  FrameId frame;             // the older frame of the map, of any session
  SE3 T_frame_keyframe;
  Matrix6 covariance = Matrix6::Zero();  // of xi = (rho, phi), metres and radians, in T_frame_keyframe Exp(xi)
  double rate_hz = 0;                    // kSlowDown

  // Whether frame, transform and covariance are set.
  bool of_frame() const { return kind < Kind::kSlowDown; }
};

// Limits of an acknowledgement.
inline constexpr std::size_t kMaxAckRanges = 32;      // in `held`, and in `missing`
inline constexpr std::size_t kMaxAckIncomplete = 16;  // keyframes in `incomplete`
inline constexpr std::size_t kMaxAckParts = 128;      // missing parts of all of these
inline constexpr std::size_t kMaxAckRefused = 64;

}  // namespace relmap
