// What the map answers, as plain values. Conventions are those of proto/geometry/geometry.h.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/map_identity.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::client {

enum class EdgeKind : std::uint8_t { kOdometry = 1, kLoop = 2, kPrior = 3 };
enum class EdgeState : std::uint8_t { kCandidate = 1, kAccepted = 2, kQuarantined = 3, kRemoved = 4 };
enum class Verification : std::uint8_t {
  kNone = 0,
  kStereo = 1,
  kPnP = 2,
  kEpipolar = 3,
  kImported = 4,
  kHomography = 5,
  kCompounded = 6
};

// "accepted"; parse_edge_state() reads it back.
const char* name_of(EdgeState state);
const char* name_of(EdgeKind kind);
const char* name_of(Verification verification);
std::optional<EdgeState> parse_edge_state(std::string_view text);

enum class SessionState : std::uint8_t { kOpen = 0, kEnded = 1, kFrozen = 2, kDeleting = 3 };
const char* name_of(SessionState state);

struct Session {
  SessionNumber number = 0;
  SessionState state = SessionState::kOpen;
  std::string uuid, robot, name;
  StereoCamera camera;  // rectified
  // Before its front-end rectified the pictures; nothing: they came rectified, or it is not known.
  std::optional<StereoCalibration> raw;
  bool oneway = false;
  std::uint32_t first = 0, last = 0;  // indices
  std::uint32_t frames = 0;
  std::int64_t first_time_us = 0, last_time_us = 0;
  std::uint32_t refused = 0, given_up = 0;  // sequences
  std::uint64_t next_sequence = 0;          // everything below is applied, refused or given up
};

// A loop closure came into a state.
struct EdgeEvent {
  std::uint64_t journal_sequence = 0;  // orders the events of a map
  EdgeState state = EdgeState::kCandidate;
  Reason reason = Reason::OK;
  EdgeId cause;  // the closure that was proposed, or edited, then
  std::string note;
};

// How far the place that a closure recognised stands out from all others.
struct Uniqueness {
  std::optional<FrameId> runner_up;  // of the places elsewhere that geometry confirms the one that fits best
  std::uint32_t runner_up_inliers = 0;
  double runner_up_probability = 0;  // by appearance
  std::uint32_t alike = 0;           // places elsewhere that geometry confirms
  std::optional<double> differs;     // share of what both views should show in which they show different things
  // Cells of the picture in which landmarks of the place should be found again, and of them those in which none is; 0:
  // not measured.
  std::uint32_t compared = 0, changed = 0;
};

// Frames along which their robot was carried, as loop closures in force say against its odometry.
struct CarriedStretch {
  FrameId first, last;           // of one session, the older first
  std::vector<EdgeId> closures;  // that say so; at most 16
};

// Frames between which nothing measured how their robot moved (Edge::unmeasured).
struct UnmeasuredStretch {
  FrameId first, last;  // of one session, the older first
  std::uint32_t steps = 0;
  double distance_m = 0;  // a guess
};
// Of a way.
struct Unmeasured {
  std::vector<UnmeasuredStretch> stretches = {};  // one after the other; at most 256
  std::uint32_t steps = 0;                        // of all: with any, the way is a guess
  double distance_m = 0;                          // of all: so much of the way's length is a guess
};

struct Edge {
  EdgeId id;
  FrameId a, b;  // older, newer
  EdgeKind kind = EdgeKind::kOdometry;
  EdgeState state = EdgeState::kAccepted;
  Reason reason = Reason::OK;
  bool carries = false;
  SE3 T_ab;
  Matrix6 covariance = Matrix6::Identity();
  std::uint32_t support = 0;
  bool prior_active = false;
  MotionSource source = MotionSource::kVision;  // of motion
  // Neither a camera nor landmarks have measured T_ab: it is a guess (`source`) of this covariance, or what the robot
  // says of a gap.
  bool unmeasured = false;
  double driven_s = 0, standing_s = 0;
  Verification verification = Verification::kNone;
  std::uint32_t inliers = 0, bound = 0;
  double probability = 0, spread = 0;
  std::vector<EdgeId> consistent_with;
  std::vector<EdgeEvent> history;             // oldest first
  std::optional<Uniqueness> uniqueness = {};  // of a closure, where it is known
  std::vector<EdgeId> carried_by = {};  // of motion: closures in force that say that the robot was carried along it
  std::optional<CarriedStretch> carried = {};  // of a closure in force that says so
};

struct Frame {
  FrameId id;
  std::int64_t time_us = 0;
  std::vector<std::string> labels;
  std::vector<Edge> edges;
  std::vector<EdgeId> incoming;
  SE3 T_odom_frame;
  std::optional<double> mean_error;  // pixels
  std::uint32_t landmarks = 0, observations = 0, appearance = 0;
  std::string thumbnail;  // JPEG
};

// A picture, or a stereo pair, and which camera took it. Files as they are: JPEG or PNG, of any camera.
struct View {
  std::string left, right;
  // Of rectified pictures; of unrectified ones; or the camera of a session of the map, as it takes pictures. None:
  // unknown, it is estimated where metres are asked for.
  std::variant<std::monostate, StereoCamera, StereoCalibration, SessionNumber> camera;
  bool rectified = false;  // with a session: the pictures are rectified already, as the map keeps them
  bool supposed = false;   // that it is this camera is not known: the answer's covariance allows for another one
  // With a session: which eye of its rig took the picture is not known; the covariance allows for the right one.
  bool either_eye = false;
  // Instead of all of these: what this frame of the map saw.
  std::optional<FrameId> frame = {};
};

struct Localisation {
  FrameId frame;
  SE3 T_frame_view;
  Matrix6 covariance = Matrix6::Identity();
  std::uint32_t inliers = 0;
  Verification verification = Verification::kNone;
  double probability = 0;  // of the place, by appearance
  double spread = 0;
  double new_place = 0;
  bool near_prior = false;                       // then probability and new_place are not known
  std::optional<double> estimated_focal_length;  // pixels of the picture; of one whose camera was not named
};

struct MatchOptions {
  std::uint32_t max_places = 0;    // 0: 20
  std::uint32_t max_verified = 0;  // of the most probable, how many geometry is tried on; 0: 10, at most 20
  bool thumbnails = false;
  std::optional<FrameId> near = {};  // thought to be near it: places around are likelier
};

struct PlaceMatch {
  FrameId frame;
  double probability = 0;  // by appearance
  Verification verification = Verification::kNone;
  std::uint32_t inliers = 0;
  double spread = 0;                // 0..1, of the picture
  std::optional<SE3> T_frame_view;  // where it is verified in metres
  Matrix6 covariance = Matrix6::Identity();
  std::optional<double> estimated_focal_length;  // as in Localisation
  Status unverified;                             // why geometry has not confirmed it
  std::string thumbnail;                         // JPEG
};
struct PlaceMatches {
  std::vector<PlaceMatch> places;  // verified ones first, by inliers; the others most probable first
  double new_place = 1;
  Status nothing_verified;  // why no place is
};

struct Robot {
  std::string name;
};
// A frame, a label, where something was seen, or where a robot is now.
using RouteEnd = std::variant<FrameId, std::string, View, Robot>;
enum class RouteBy : std::uint8_t { kDistance = 1, kTime = 2, kCertainty = 3 };

// What counts how much, for each edge; relmap/v1/map.proto.
struct RouteWeights {
  double metre = 0, driven_second = 0, standing_second = 0, square_metre_of_variance = 0;
};
struct RouteFilter {
  std::vector<SessionNumber> sessions;  // whose frames may be passed; none: all
  std::vector<FrameId> avoid_frames;
  std::vector<std::string> avoid_labels;
  std::uint32_t min_support = 0;
  bool long_loops = true;
  bool suppose_candidates = false, suppose_quarantined = false;
};

struct RouteRequest {
  RouteEnd from, to;
  RouteBy by = RouteBy::kDistance;
  bool count_standing = false;
  double max_cost = 0;                             // metres, seconds, or as the weights have it; 0: no limit
  std::vector<RouteEnd> or_from = {}, or_to = {};  // as good as these
  std::optional<RouteWeights> weights = {};        // instead of `by`
  RouteFilter filter = {};
  bool covariance = false;  // with each step
};

struct RouteStep {
  FrameId frame;
  double distance_m = 0, time_s = 0;  // from the start
  std::vector<std::string> labels;
  std::optional<EdgeId> edge;  // to the next step
  EdgeKind kind = EdgeKind::kOdometry;
  SE3 T_to_next;
  bool long_loop = false;
  bool carried = false;     // the robot was carried along the edge to the next step
  bool unmeasured = false;  // nothing measured that edge
  // On request.
  SE3 T_start_this;
  Matrix6 covariance = Matrix6::Zero();  // of T_start_this Exp(xi)
};
struct Route {
  FrameId from, to;
  double cost = 0;  // what was made least
  double distance_m = 0, time_s = 0;
  std::uint32_t long_loops = 0;
  std::vector<CarriedStretch> carried;  // in the order of the route
  Unmeasured unmeasured = {};           // so, too
  std::string frame_by_frame;           // why the daemon had to search so; empty: it passed cells
  // Closures that only bind landmarks were ways, too: the daemon searched frame by frame, or the route is short and its
  // goal lies among the 2,000 frames nearest to the start.
  bool bound_closures = false;
  bool no_way_by_edges = false;                    // and edges alone lead to no goal, or to none within max_cost
  std::optional<Localisation> from_view, to_view;  // of ends that are pictures
  std::vector<RouteStep> steps;
};

struct TransformBetween {
  SE3 T_ab;
  Matrix6 covariance = Matrix6::Identity();
  std::uint32_t edges = 0;
  double distance_m = 0;
  bool compounded = false;                   // the covariance: from those of single edges
  std::vector<CarriedStretch> carried = {};  // on the path, from a to b
  Unmeasured unmeasured = {};                // so, too
};

struct LabelledFrames {
  std::string label;
  std::vector<FrameId> frames;
};

// A piece of a pose graph: frames without pictures, axes of a camera (x right, y down, z forward).
struct GraphPiece {
  struct Frame {
    SE3 T_odom_frame;
    std::optional<Matrix6> step_covariance;  // of the step from the frame before; none: it is not known
    std::int64_t time_us = 0;                // UTC
    std::int64_t driven_us = 0;
  };
  struct Loop {
    std::uint32_t query = 0, match = 0;  // indices; query is the later
    SE3 T_match_query;
    Matrix6 covariance = Matrix6::Identity();
  };
  static constexpr std::size_t kMaxSent = 1000;  // of either

  SessionUuid session;
  std::string robot, name;
  std::uint32_t first = 0;  // index of frames[0]
  std::vector<Frame> frames;
  std::vector<Loop> loops;
};

struct EdgeFilter {
  std::vector<EdgeState> states;  // empty: all
  std::vector<EdgeKind> kinds;    // empty: all
  SessionNumber session = 0;      // 0: any
  std::optional<FrameId> frame;
};

// What an operator does to a loop closure.
enum class EdgeAction : std::uint8_t {
  kRemove,       // out of the map, with all that agree with it
  kRemoveAlone,  // out of the map by itself: those that agree with it stay
  kRestore,      // back as it was, with what went with it
  kAccept,       // into force, whatever it is: it is not outvoted from now on
  kWithdraw      // what it was before it was accepted so
};
struct EditOptions {
  std::string note = {};  // for the journal
  bool dry_run = false;   // says what the edit would change, and changes nothing
  // A removal's: EdgeEdit::shown of a dry run. WRONG_STATE if other closures would go by now; 0: whatever there is
  // goes.
  std::uint64_t shown = 0;
};

struct ClosureChange {
  EdgeId id;
  FrameId a, b;                            // older, newer
  std::optional<EdgeState> before, after;  // none: it was, or is, not there
  Reason reason_before = Reason::OK, reason_after = Reason::OK;
  bool edge_before = false, edge_after = false;  // an edge of the graph
  std::uint32_t bound = 0, bound_frames = 0;     // what it binds while it is in force, and in how many frames
};
struct EditEffect {
  std::vector<ClosureChange> closures;
  std::vector<CarriedStretch> carried, not_carried;  // from now on, and not any more
};
// Of an edit, or a proposal. In a dry run: as it would be.
struct EdgeEdit {
  Edge edge;  // after
  EditEffect effect;
  bool done = false;        // not a dry run
  std::uint64_t shown = 0;  // of a removal's dry run: stands for the closures that would go, for EditOptions
};

enum class ExportFormat : std::uint8_t { kTum = 1, kKitti = 2 };
// The next bytes of a session's file.
struct TrajectoryPiece {
  SessionNumber session = 0;
  std::string_view bytes;
  std::vector<Edge> doubtful;  // steps in it that nothing measured, or along which the robot was carried
};

struct ExportedFrame {
  FrameId id;
  std::int64_t time_us = 0;  // UTC
  struct Landmark {
    Eigen::Vector3f point;        // in the frame's coordinates, metres
    std::uint32_t observers = 0;  // frames that determine it
  };
  std::vector<Landmark> landmarks;  // in force, based in the frame, their depth measured
};

using ReasonCounts = std::map<Reason, std::uint64_t>;

// One session on its way in; counts are since the daemon heard of it first.
struct RobotStatus {
  std::string uuid;
  SessionNumber session = 0;                    // 0: not begun
  std::string robot, name;                      // empty: nothing whole came yet
  double keyframes_per_s = 0, bytes_per_s = 0;  // over the last ten seconds
  double silent_s = 0;                          // since it was heard last
  std::optional<double> lag_s;      // from the time stamp of its newest durable keyframe till that was durable
  std::uint64_t next_sequence = 0;  // everything below is settled
  std::uint64_t seen = 0;           // 1 + the highest sequence that something came of
  std::uint32_t missing = 0, incomplete = 0, pending = 0;
  std::uint32_t queued_messages = 0;
  std::uint64_t dropped_messages = 0;
  std::uint32_t credits = 0;
  ReasonCounts refused, not_taken;
  Reason blocked = Reason::OK;
  double limit_hz = 0;
  std::vector<std::string> same_name;  // uuids of sessions that other robots of this name bring at the same time
  bool silent = false;                 // for a minute or more, though its session has not ended; as it was heard last
};

struct MemoryShare {
  std::string name;
  std::uint64_t used = 0, allowance = 0;
};

// A session whose pictures contradict the calibration of others', where they show the same places.
struct DoubtfulCamera {
  SessionNumber session = 0;
  std::string robot, name;
  std::vector<SessionNumber> against;
  std::uint64_t contradicted = 0;  // keyframes, of it and of those, since the daemon started
  std::string message;             // of the last one: what would fit
};

struct DaemonStatus {
  std::string version, boot_id, data_folder, lcm_url;
  MapIdentity map;  // not known: the daemon does not say it
  std::uint64_t pid = 0;
  std::int64_t uptime_us = 0;
  bool deterministic = false;
  Status storage, lcm;  // not ok: why the daemon takes nothing in

  std::uint32_t sessions = 0, labels = 0;
  std::uint64_t frames = 0, gaps = 0, refused = 0, places = 0, places_left_out = 0;
  ReasonCounts refused_by_reason;
  std::vector<DoubtfulCamera> doubtful_cameras;
  // What routes are found by in milliseconds; why that is missing (empty: it is not).
  std::uint64_t route_chunks = 0, route_chunks_changed = 0, route_cells_outdated = 0;
  std::uint32_t route_weights = 0;
  std::string routes_missing_because;
  std::uint64_t closures_candidate = 0, closures_accepted = 0, closures_quarantined = 0, closures_removed = 0;

  std::uint64_t durable_sequence = 0, applied_sequence = 0;
  std::uint64_t queued = 0, lookup_lag = 0, pending_frames = 0;
  double relaxation_p50_us = 0, relaxation_p99_us = 0, relaxation_max_us = 0;
  double active_frames_mean = 0;
  std::uint64_t solves = 0, numerical_failures = 0;

  std::uint64_t memory_budget = 0, memory_used = 0, resident_bytes = 0, resident_max_bytes = 0;
  std::vector<MemoryShare> memory_shares;
  std::uint32_t vocabulary_words = 0;
  std::string vocabulary_source;

  std::uint64_t ingest_keyframes = 0, ingest_repeats = 0, ingest_parts_corrupt = 0, robots = 0;
  ReasonCounts not_taken;
};

}  // namespace relmap::client
