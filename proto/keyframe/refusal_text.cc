#include "proto/keyframe/refusal_text.h"

namespace relmap {

std::string_view refusal_text(Reason reason) {
  switch (reason) {
    case Reason::NOT_FINITE:
      return "it holds NaN or infinity where a number is needed";
    case Reason::BAD_SIZE:
      return "it holds more than a keyframe may";
    case Reason::TIME_BACKWARDS:
      return "its time is not later than that of the keyframe before";
    case Reason::TIME_AHEAD:
      return "its time is more than a day ahead of the server's clock";
    case Reason::BAD_DURATION:
      return "its time, or the time that it drove or stood, is none that a robot can have";
    case Reason::IMPLAUSIBLE_CALIBRATION:
      return "its calibration is none that a camera can have";
    case Reason::CALIBRATION_CHANGED:
      return "its camera is not the one that the session began with";
    case Reason::CORRUPT:
      return "its bytes are damaged, or are no keyframe";
    case Reason::TRUNCATED:
      return "its bytes end before all that they announce";
    case Reason::SEQUENCE_CONFLICT:
      return "the map has another keyframe of this sequence";
    case Reason::SEQUENCE_SETTLED:
      return "its sequence was refused or given up before";
    case Reason::SEQUENCE_TOO_FAR:
      return "its sequence is further ahead than can be kept";
    case Reason::BAD_ROTATION:
      return "the rotation of its odometry is none";
    case Reason::BAD_COVARIANCE:
      return "the covariance of its step is not symmetric and positive definite";
    case Reason::BAD_MOTION:
      return "its odometry is further from its origin than any robot drives";
    case Reason::OUTSIDE_PICTURE:
      return "it measured something outside of its picture";
    case Reason::BAD_TRACK:
      return "one of its tracks is from the future, occurs twice, or has an unknown level";
    case Reason::NOT_STEREO:
      return "it measured depth, but its camera has one eye";
    case Reason::NOT_A_PICTURE:
      return "its picture is no JPEG";
    case Reason::UNKNOWN_PROTOCOL_VERSION:
      return "it is of another version of the protocol";
    case Reason::BAD_NAME:
      return "the name of its robot or session is none, or is not the one that the session began with";
    case Reason::NOT_ALLOWED:
      return "its robot is not on the list, or its sender may not send for this robot";
    case Reason::SESSION_FROZEN:
      return "an operator has frozen the session";
    case Reason::SESSION_DELETED:
      return "an operator has deleted the session";
    default:
      return "";
  }
}

}  // namespace relmap
