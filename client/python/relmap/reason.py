"""Why something was refused, failed, or is in its state. Names and numbers are those of relmap/v1/reason.proto."""

from __future__ import annotations

from relmap.enums import NamedEnum, OpenEnum


class ReasonGroup(NamedEnum):
    """What a reason is about; each group has an exception of its own (relmap.errors)."""

    OK = "ok"
    ROBOT_DATA = "what a robot sent"
    REQUEST = "what a caller asked"
    PLACE = "a place that is not recognised"
    CLOSURE = "the state of a loop closure"
    DAEMON = "the daemon and its disk"
    ACCESS = "who the caller is, and what he may do"
    CAMERA = "a camera"


class Reason(OpenEnum):
    """A reason. The comment of each is in relmap/v1/reason.proto, and `relmap-admin explain NAME` says what to do.

    A number that this version does not know, from a newer relmapd, becomes a member named ``UNKNOWN_<number>``.
    """

    OK = 0
    # What a robot sent.
    NOT_FINITE = 1
    BAD_SIZE = 2
    TIME_BACKWARDS = 3
    IMPLAUSIBLE_CALIBRATION = 4
    CALIBRATION_CHANGED = 5
    CORRUPT = 6
    TRUNCATED = 7
    SEQUENCE_CONFLICT = 8
    BAD_ROTATION = 9
    BAD_COVARIANCE = 10
    OUTSIDE_PICTURE = 11
    BAD_TRACK = 12
    UNKNOWN_PROTOCOL_VERSION = 13
    BAD_NAME = 14
    SEQUENCE_TOO_FAR = 15
    BAD_DURATION = 16
    SEQUENCE_SETTLED = 17
    DROPPED_BY_ROBOT = 18
    CAPTURE_FAILED = 19
    BAD_MOTION = 20
    TIME_AHEAD = 21
    NOT_ALLOWED = 22
    RATE_LIMITED = 23
    SESSION_FROZEN = 24
    SESSION_DELETED = 25
    MAP_RESTORED = 26
    # What a caller asked.
    INVALID_ARGUMENT = 40
    NO_SUCH_SESSION = 41
    NO_SUCH_FRAME = 42
    NO_SUCH_EDGE = 43
    NO_SUCH_LABEL = 44
    NOT_CONNECTED = 45
    OUT_OF_REACH = 46
    NEW_PLACE = 47
    AMBIGUOUS_PLACE = 48
    TOO_FEW_FEATURES = 49
    TOO_FEW_INLIERS = 50
    POOR_SPREAD = 51
    NOT_A_PICTURE = 52
    PICTURE_TOO_LARGE = 53
    PICTURE_DAMAGED = 54
    NO_CALIBRATION = 55
    ODOMETRY_EDGE = 56
    EMPTY_MAP = 57
    NOT_STEREO = 58
    COST_LIMIT = 59
    WRONG_STATE = 60
    NOT_CONFIRMED = 61
    WRONG_CALIBRATION = 62
    # Why a loop closure is in its state.
    CONSISTENT = 80
    LONE = 81
    INCONSISTENT = 82
    REMOVED_BY_OPERATOR = 83
    REMOVED_WITH_SET = 84
    MOTION = 85
    DECLARED_GAP = 86
    CONTRADICTS_MOTION = 87
    ACCEPTED_BY_OPERATOR = 88
    CARRIED = 89
    BEYOND_DOUBT = 90
    LOOKS_ALIKE = 91
    REMOVED_ALONE = 92
    NOT_SEEN_BEYOND = 93
    # The daemon and its disk.
    UNIMPLEMENTED = 100
    BUDGET_EXCEEDED = 101
    VIEW_EXPIRED = 102
    DEADLINE = 103
    SHUTTING_DOWN = 104
    READ_ONLY = 105
    DATA_LOSS = 106
    STALE_OWNER = 107
    IO_ERROR = 108
    UNKNOWN_FORMAT_VERSION = 109
    FOLDER_LOCKED = 110
    PORT_IN_USE = 111
    NO_MULTICAST_ROUTE = 112
    WRONG_VOCABULARY = 113
    BAD_CONFIG = 114
    UNREACHABLE = 115
    NO_SUCH_FILE = 116
    UNSUPPORTED = 117
    NUMERICAL = 118
    INTERNAL = 119
    DISK_FULL = 120
    NOT_A_MAP = 121
    WRONG_MAP = 122
    UNAUTHENTICATED = 123
    REPLAYED = 124
    TOO_MANY_FILES = 125
    STALLED = 126
    NEEDS_RESTART = 127
    # A camera.
    NO_CAMERA = 140
    CAMERA_GONE = 141
    CAMERA_BUSY = 142
    CAMERA_FORBIDDEN = 143
    CAMERA_SILENT = 144
    CAMERA_STALLED = 145
    SHORT_FRAME = 146
    FRAME_DAMAGED = 147
    NO_BANDWIDTH = 148
    EYE_DEAD = 149
    REGISTER_REFUSED = 150
    OUT_OF_FOCUS = 151
    ROWS_APART = 152

    @property
    def group(self) -> ReasonGroup:
        """The group that the reason belongs to, also for reasons of a newer relmapd."""
        if self in _GROUP_OF:
            return _GROUP_OF[self]
        for below, group in _GROUPS_BELOW:
            if self < below:
                return group
        return ReasonGroup.DAEMON


# Reasons that stand in another part of the list than what they are about.
_GROUP_OF = {
    Reason.OK: ReasonGroup.OK,
    Reason.NOT_ALLOWED: ReasonGroup.ACCESS,
    Reason.UNAUTHENTICATED: ReasonGroup.ACCESS,
    Reason.REPLAYED: ReasonGroup.ACCESS,
    Reason.NEW_PLACE: ReasonGroup.PLACE,
    Reason.AMBIGUOUS_PLACE: ReasonGroup.PLACE,
    Reason.TOO_FEW_FEATURES: ReasonGroup.PLACE,
    Reason.TOO_FEW_INLIERS: ReasonGroup.PLACE,
    Reason.POOR_SPREAD: ReasonGroup.PLACE,
    Reason.EMPTY_MAP: ReasonGroup.PLACE,
    Reason.WRONG_STATE: ReasonGroup.CLOSURE,
    Reason.ODOMETRY_EDGE: ReasonGroup.CLOSURE,
}
_GROUPS_BELOW = (
    (40, ReasonGroup.ROBOT_DATA),
    (80, ReasonGroup.REQUEST),
    (100, ReasonGroup.CLOSURE),
    (140, ReasonGroup.DAEMON),
    (180, ReasonGroup.CAMERA),
)
