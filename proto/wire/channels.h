// LCM channels and the version of the protocol that runs on them and over RPC.
#pragma once

#include <cstdint>

namespace relmap {

inline constexpr char kKeyframeChannel[] = "RELMAP_KEYFRAME";  // keyframe_part_t, robot to daemon
inline constexpr char kGapChannel[] = "RELMAP_GAP";            // gap_t, robot to daemon
inline constexpr char kEndChannel[] = "RELMAP_END";            // session_end_t, robot to daemon
inline constexpr char kAckChannel[] = "RELMAP_ACK";            // acknowledgement_t, daemon to robot
inline constexpr char kPoseChannel[] = "RELMAP_POSE";          // pose_t, daemon to robot
inline constexpr char kMapChannel[] = "RELMAP_MAP";            // map_identity_t, daemon to all
inline constexpr char kStatusChannel[] = "RELMAP_STATUS";      // status_t, daemon to all

// Peers of another major version do not understand each other: UNKNOWN_PROTOCOL_VERSION. A minor one only adds.
inline constexpr std::uint16_t kProtocolMajor = 1;
inline constexpr std::uint16_t kProtocolMinor = 0;

}  // namespace relmap
