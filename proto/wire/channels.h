// The LCM channels, and the version of the protocol over LCM and RPC.
#pragma once

#include <cstdint>

namespace relmap {

inline constexpr char kKeyframeChannel[] = "RELMAP_KEYFRAME";  // keyframe_part_t, robot to daemon
inline constexpr char kGapChannel[] = "RELMAP_GAP";            // gap_t, robot to daemon
inline constexpr char kEndChannel[] = "RELMAP_END";            // session_end_t, robot to daemon
inline constexpr char kHelloChannel[] = "RELMAP_HELLO";        // hello_t, robot to daemon
inline constexpr char kAckChannel[] = "RELMAP_ACK";            // acknowledgement_t, daemon to robot
inline constexpr char kPoseChannel[] = "RELMAP_POSE";          // pose_t, daemon to robot
inline constexpr char kMapChannel[] = "RELMAP_MAP";            // map_identity_t, daemon to all
inline constexpr char kStatusChannel[] = "RELMAP_STATUS";      // status_t, daemon to all

// A peer with another major version is refused: UNKNOWN_PROTOCOL_VERSION. A new minor version only adds.
inline constexpr std::uint16_t kProtocolMajor = 1;
inline constexpr std::uint16_t kProtocolMinor = 0;

}  // namespace relmap
