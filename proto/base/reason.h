// Why something was refused, failed, or is in its state. Every negative answer carries a reason. The numbers are those
// of relmap.v1.Reason (proto/relmap/v1/reason.proto) and never change; a test in proto/wire compares names and numbers.
#pragma once

#include <cstdint>
#include <string_view>

namespace relmap {

// X(name, number): the list from which the enum and its names are made.
#define RELMAP_REASONS(X)                                                                                             \
  X(OK, 0)                                                                                                            \
  /* What a robot sent. */                                                                                            \
  X(NOT_FINITE, 1)              /* NaN or infinity where a number is needed */                                        \
  X(BAD_SIZE, 2)                /* too many or too few elements, or a payload over its limit */                       \
  X(TIME_BACKWARDS, 3)          /* not later than the session's previous keyframe */                                  \
  X(IMPLAUSIBLE_CALIBRATION, 4) /* fails check_plausible() */                                                         \
  X(CALIBRATION_CHANGED, 5)     /* differs from the one that the session began with */                                \
  X(CORRUPT, 6)                 /* CRC32C mismatch or undecodable bytes */                                            \
  X(TRUNCATED, 7)               /* the bytes end before all that they announce */                                     \
  X(SEQUENCE_CONFLICT, 8)       /* the daemon has this sequence with another CRC32C */                                \
  X(BAD_ROTATION, 9)            /* quaternion is not of unit length */                                                \
  X(BAD_COVARIANCE, 10)         /* not symmetric positive definite */                                                 \
  X(OUTSIDE_PICTURE, 11)        /* a measurement outside the picture or with u_right > u_left */                      \
  X(BAD_TRACK, 12)              /* track from the future, twice in one keyframe, or of an unknown level */            \
  X(UNKNOWN_PROTOCOL_VERSION, 13)                                                                                     \
  X(BAD_NAME, 14)         /* empty, too long, or not UTF-8 */                                                         \
  X(SEQUENCE_TOO_FAR, 15) /* further ahead of the session than the daemon can keep */                                 \
  X(BAD_DURATION, 16)     /* driven or standing time negative or longer than elapsed; a time outside 1970..2255 */    \
  X(SEQUENCE_SETTLED, 17) /* already refused or given up as a gap */                                                  \
  X(DROPPED_BY_ROBOT, 18) /* a gap: the robot's spool was full */                                                     \
  X(CAPTURE_FAILED, 19)   /* a gap: the robot's source failed */                                                      \
  X(BAD_MOTION, 20)       /* an odometry pose no robot could have (> 1e7 m) */                                        \
  X(TIME_AHEAD, 21)       /* a time stamp far ahead: of the pairs around it, or of the server's clock */              \
  X(NOT_ALLOWED, 22)      /* the robot is not on the daemon's list, or the caller's role does not allow it */         \
  X(RATE_LIMITED, 23)     /* more than the daemon takes from one robot; kept by the robot and sent again */           \
  X(SESSION_FROZEN, 24)   /* an operator froze the session: it accepts no more keyframes */                           \
  X(SESSION_DELETED, 25)  /* the session is being deleted, or has been */                                             \
  X(MAP_RESTORED, 26)     /* a gap: the map was restored from a backup that is older than what the robot still has */ \
  /* What a caller asked. */                                                                                          \
  X(INVALID_ARGUMENT, 40)                                                                                             \
  X(NO_SUCH_SESSION, 41)                                                                                              \
  X(NO_SUCH_FRAME, 42)                                                                                                \
  X(NO_SUCH_EDGE, 43)                                                                                                 \
  X(NO_SUCH_LABEL, 44)                                                                                                \
  X(NOT_CONNECTED, 45)   /* no chain of accepted edges between the two */                                             \
  X(OUT_OF_REACH, 46)    /* further than the search's work limit */                                                   \
  X(NEW_PLACE, 47)       /* most likely a place the map does not hold */                                              \
  X(AMBIGUOUS_PLACE, 48) /* several places explain the picture about as well */                                       \
  X(TOO_FEW_FEATURES, 49)                                                                                             \
  X(TOO_FEW_INLIERS, 50) /* geometry did not confirm the place */                                                     \
  X(POOR_SPREAD, 51)     /* inliers in one corner of the picture only */                                              \
  X(NOT_A_PICTURE, 52)   /* neither JPEG nor PNG */                                                                   \
  X(PICTURE_TOO_LARGE, 53)                                                                                            \
  X(PICTURE_DAMAGED, 54)                                                                                              \
  X(NO_CALIBRATION, 55) /* the question needs a camera and none was given */                                          \
  X(ODOMETRY_EDGE, 56)  /* odometry edges are never removed */                                                        \
  X(EMPTY_MAP, 57)                                                                                                    \
  X(NOT_STEREO, 58)                                                                                                   \
  X(COST_LIMIT, 59)        /* no route within the maximum cost */                                                     \
  X(WRONG_STATE, 60)       /* the edge is already in that state, or cannot enter it */                                \
  X(NOT_CONFIRMED, 61)     /* the user did not say yes, or there was nobody to ask */                                 \
  X(WRONG_CALIBRATION, 62) /* the picture contradicts it: taken by another camera, or not rectified */                \
  /* Why a loop closure is in its state. */                                                                           \
  X(CONSISTENT, 80)   /* accepted: agrees with others of another query frame */                                       \
  X(LONE, 81)         /* candidate: nothing agrees with it yet */                                                     \
  X(INCONSISTENT, 82) /* outvoted by a larger consistent set */                                                       \
  X(REMOVED_BY_OPERATOR, 83)                                                                                          \
  X(REMOVED_WITH_SET, 84)     /* went with the consistent set of a removed closure */                                 \
  X(MOTION, 85)               /* accepted: an edge of the robot's own motion */                                       \
  X(DECLARED_GAP, 86)         /* accepted: bridges keyframes the robot gave up */                                     \
  X(CONTRADICTS_MOTION, 87)   /* candidate: the robot's own motion says otherwise */                                  \
  X(ACCEPTED_BY_OPERATOR, 88) /* accepted: an operator decided; never outvoted */                                     \
  X(CARRIED, 89)              /* accepted: shows, as others do, that the robot was carried */                         \
  X(BEYOND_DOUBT, 90)         /* accepted alone: its geometry is strong and no other place comes near it */           \
  X(LOOKS_ALIKE, 91)     /* another place that looks alike: so say all closures between two stretches of motion */    \
  X(REMOVED_ALONE, 92)   /* an operator removed this closure and none of those that agree with it */                  \
  X(NOT_SEEN_BEYOND, 93) /* quarantined: going on, the robot saw nothing of what the map shows */                     \
  /* The daemon and its disk. */                                                                                      \
  X(UNIMPLEMENTED, 100)                                                                                               \
  X(BUDGET_EXCEEDED, 101)                                                                                             \
  X(VIEW_EXPIRED, 102)                                                                                                \
  X(DEADLINE, 103)                                                                                                    \
  X(SHUTTING_DOWN, 104)                                                                                               \
  X(READ_ONLY, 105)                                                                                                   \
  X(DATA_LOSS, 106)                                                                                                   \
  X(STALE_OWNER, 107)                                                                                                 \
  X(IO_ERROR, 108)                                                                                                    \
  X(UNKNOWN_FORMAT_VERSION, 109)                                                                                      \
  X(FOLDER_LOCKED, 110) /* another process owns the data folder */                                                    \
  X(PORT_IN_USE, 111)                                                                                                 \
  X(NO_MULTICAST_ROUTE, 112)                                                                                          \
  X(WRONG_VOCABULARY, 113)                                                                                            \
  X(BAD_CONFIG, 114)                                                                                                  \
  X(UNREACHABLE, 115) /* no daemon answers there */                                                                   \
  X(NO_SUCH_FILE, 116)                                                                                                \
  X(UNSUPPORTED, 117) /* understood, but not something this build or source can do */                                 \
  X(NUMERICAL, 118)   /* a solve that met a singular system or NaN; the map is as it was */                           \
  X(INTERNAL, 119)                                                                                                    \
  X(DISK_FULL, 120)       /* the disk of the data folder is full, or below its low-water mark */                      \
  X(NOT_A_MAP, 121)       /* the folder is neither empty nor the data folder of a map */                              \
  X(WRONG_MAP, 122)       /* the daemon serves another map than the one that was begun in */                          \
  X(UNAUTHENTICATED, 123) /* no credentials, or they are unknown, expired or revoked */                               \
  X(REPLAYED, 124)        /* a sealed message that came before, or is not of these seconds */                         \
  X(TOO_MANY_FILES, 125)  /* the process may open no more files and connections */                                    \
  X(STALLED, 126)         /* a thread of the daemon has been at one piece of work for seconds: a disk that hangs */   \
  X(NEEDS_RESTART, 127)   /* a setting that was changed takes effect only when the daemon is started again */         \
  /* A camera. */                                                                                                     \
  X(NO_CAMERA, 140)        /* none at all, or none of that serial number */                                           \
  X(CAMERA_GONE, 141)      /* unplugged, or the process that serves its bus has ended */                              \
  X(CAMERA_BUSY, 142)      /* another program holds it */                                                             \
  X(CAMERA_FORBIDDEN, 143) /* no permission to its device */                                                          \
  X(CAMERA_SILENT, 144)    /* no frame within its time */                                                             \
  X(CAMERA_STALLED, 145)   /* its endpoint had halted; a frame is lost */                                             \
  X(SHORT_FRAME, 146)      /* fewer bytes than a frame has */                                                         \
  X(FRAME_DAMAGED, 147)    /* too many bytes, a transfer that failed, or bytes of two frames */                       \
  X(NO_BANDWIDTH, 148)     /* the bus has none left for what is asked for */                                          \
  X(EYE_DEAD, 149)         /* one eye shows nothing, or the same at all times */                                      \
  X(REGISTER_REFUSED, 150) /* a register holds another value than was written */                                      \
  X(OUT_OF_FOCUS, 151)     /* no sharp edges in the pictures of an eye */                                             \
  X(ROWS_APART, 152)       /* what both eyes see lies on different rows: not the calibration of this camera */

enum class Reason : std::uint16_t {
#define X(name, number) name = number,
  RELMAP_REASONS(X)
#undef X
};

// The name, as in "NOT_FINITE"; "UNKNOWN" for a number that is not in the list.
std::string_view reason_name(Reason reason);

// True if `number` is in the list. To be asked where a reason is read from bytes.
bool is_reason(std::uint16_t number);

}  // namespace relmap
