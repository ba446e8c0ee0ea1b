#include "server/rpc/error_mapping.h"

#include "proto/wire/convert.h"

namespace relmap::rpc {

grpc::StatusCode status_code(Reason reason) {
  switch (reason) {
    case Reason::OK:
    case Reason::CONSISTENT:
    case Reason::MOTION:
    case Reason::DECLARED_GAP:
    case Reason::CONTRADICTS_MOTION:
    case Reason::ACCEPTED_BY_OPERATOR:
    case Reason::CARRIED:
    case Reason::BEYOND_DOUBT:
    case Reason::LOOKS_ALIKE:
    case Reason::NOT_SEEN_BEYOND:
      return grpc::StatusCode::OK;

    case Reason::NOT_FINITE:
    case Reason::BAD_SIZE:
    case Reason::TIME_BACKWARDS:
    case Reason::TIME_AHEAD:
    case Reason::IMPLAUSIBLE_CALIBRATION:
    case Reason::CALIBRATION_CHANGED:
    case Reason::CORRUPT:
    case Reason::TRUNCATED:
    case Reason::BAD_ROTATION:
    case Reason::BAD_COVARIANCE:
    case Reason::OUTSIDE_PICTURE:
    case Reason::BAD_TRACK:
    case Reason::BAD_NAME:
    case Reason::BAD_DURATION:
    case Reason::BAD_MOTION:
    case Reason::INVALID_ARGUMENT:
    case Reason::NOT_A_PICTURE:
    case Reason::PICTURE_TOO_LARGE:
    case Reason::PICTURE_DAMAGED:
    case Reason::NO_CALIBRATION:
    case Reason::WRONG_CALIBRATION:
    case Reason::NOT_STEREO:
    case Reason::BAD_CONFIG:
      return grpc::StatusCode::INVALID_ARGUMENT;

    case Reason::SEQUENCE_CONFLICT:
    case Reason::SEQUENCE_SETTLED:
    case Reason::PORT_IN_USE:
      return grpc::StatusCode::ALREADY_EXISTS;

    case Reason::NO_SUCH_SESSION:
    case Reason::NO_SUCH_FRAME:
    case Reason::NO_SUCH_EDGE:
    case Reason::NO_SUCH_LABEL:
    case Reason::NO_SUCH_FILE:
    case Reason::NO_CAMERA:
    case Reason::NEW_PLACE:
    case Reason::AMBIGUOUS_PLACE:
    case Reason::TOO_FEW_FEATURES:
    case Reason::TOO_FEW_INLIERS:
    case Reason::POOR_SPREAD:
      return grpc::StatusCode::NOT_FOUND;

    case Reason::OUT_OF_REACH:
    case Reason::COST_LIMIT:
    case Reason::SEQUENCE_TOO_FAR:
      return grpc::StatusCode::OUT_OF_RANGE;

    case Reason::NOT_CONNECTED:
    case Reason::ODOMETRY_EDGE:
    case Reason::EMPTY_MAP:
    case Reason::WRONG_STATE:
    case Reason::NOT_CONFIRMED:
    case Reason::NOT_A_MAP:
    case Reason::WRONG_MAP:
    case Reason::UNKNOWN_PROTOCOL_VERSION:
    case Reason::UNKNOWN_FORMAT_VERSION:
    case Reason::READ_ONLY:
    case Reason::WRONG_VOCABULARY:
    case Reason::FOLDER_LOCKED:
    case Reason::SESSION_FROZEN:
    case Reason::SESSION_DELETED:
    case Reason::LONE:
    case Reason::INCONSISTENT:
    case Reason::REMOVED_BY_OPERATOR:
    case Reason::REMOVED_WITH_SET:
    case Reason::REMOVED_ALONE:
    case Reason::NEEDS_RESTART:
      return grpc::StatusCode::FAILED_PRECONDITION;

    case Reason::NOT_ALLOWED:
    case Reason::CAMERA_FORBIDDEN:
      return grpc::StatusCode::PERMISSION_DENIED;
    case Reason::UNAUTHENTICATED:
    case Reason::REPLAYED:
      return grpc::StatusCode::UNAUTHENTICATED;
    case Reason::BUDGET_EXCEEDED:
    case Reason::RATE_LIMITED:
    case Reason::DISK_FULL:
    case Reason::TOO_MANY_FILES:
    case Reason::NO_BANDWIDTH:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case Reason::VIEW_EXPIRED:
    case Reason::STALE_OWNER:
      return grpc::StatusCode::ABORTED;
    case Reason::DEADLINE:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    case Reason::SHUTTING_DOWN:
    case Reason::STALLED:
    case Reason::UNREACHABLE:
    case Reason::NO_MULTICAST_ROUTE:
    case Reason::DROPPED_BY_ROBOT:
    case Reason::CAPTURE_FAILED:
    case Reason::MAP_RESTORED:
    case Reason::CAMERA_GONE:
    case Reason::CAMERA_BUSY:
    case Reason::CAMERA_SILENT:
    case Reason::CAMERA_STALLED:
    case Reason::SHORT_FRAME:
    case Reason::FRAME_DAMAGED:
    case Reason::EYE_DEAD:
    case Reason::REGISTER_REFUSED:
    case Reason::OUT_OF_FOCUS:
    case Reason::ROWS_APART:
      return grpc::StatusCode::UNAVAILABLE;
    case Reason::DATA_LOSS:
      return grpc::StatusCode::DATA_LOSS;
    case Reason::UNIMPLEMENTED:
    case Reason::UNSUPPORTED:
      return grpc::StatusCode::UNIMPLEMENTED;
    case Reason::IO_ERROR:
    case Reason::NUMERICAL:
    case Reason::INTERNAL:
      return grpc::StatusCode::INTERNAL;
  }
  return grpc::StatusCode::INTERNAL;
}

grpc::Status to_grpc(const Status& status, const std::string& request_id) {
  if (status.ok()) return grpc::Status::OK;
  v1::Error error;
  error.set_reason(to_wire(status.reason()));
  error.set_message(status.message());
  error.set_request_id(request_id);
  return {status_code(status.reason()), status.to_string(), error.SerializeAsString()};
}

}  // namespace relmap::rpc
