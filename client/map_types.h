// Requests to the map and its answers, as plain values. proto/geometry/geometry.h has the conventions for transforms
// and covariances, relmap/v1/map.proto the full description of each field.
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

// How matrices are laid out depends on this, and it must be the same as in the library.
static_assert(
    EIGEN_MAX_STATIC_ALIGN_BYTES == 16,
    "relmap's client is not compiled for AVX: with -mavx or -march=native say -DEIGEN_MAX_STATIC_ALIGN_BYTES=16");

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

// The name for display, as in "accepted". parse_edge_state() reads the name of a state.
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
  // Before rectification; absent if the pictures came rectified, or it is not known.
  std::optional<StereoCalibration> raw;
  bool oneway = false;
  std::uint32_t first = 0, last = 0;  // lowest and highest index of its frames
  std::uint32_t frames = 0;
  std::int64_t first_time_us = 0, last_time_us = 0;
  std::uint32_t refused = 0, given_up = 0;  // numbers of sequences
  std::uint64_t next_sequence = 0;          // everything below is applied, refused or given up
};

// A change of a loop closure's state.
struct EdgeEvent {
  std::uint64_t journal_sequence = 0;  // orders the events of a map
  EdgeState state = EdgeState::kCandidate;
  Reason reason = Reason::OK;
  EdgeId cause;      // the closure whose proposal or edit caused it
  std::string note;  // the operator's note
  // When the record that caused it was submitted, UTC, and by whom: the name in the caller's credentials, or "relmapd".
  // 0 and empty: not known, as for all that happened before the map kept them.
  std::int64_t time_us = 0;
  std::string author = {};
};

// How much the place that a closure recognised stands out from all other places.
struct Uniqueness {
  std::optional<FrameId> runner_up;  // the best fitting of the other places that geometry confirms
  std::uint32_t runner_up_inliers = 0;
  double runner_up_probability = 0;  // by appearance
  std::uint32_t alike = 0;           // number of other places that geometry confirms
  std::optional<double> differs;     // of what both views should show, the share in which they differ, 0..1
  // Number of cells of the picture in which landmarks of the place should be found, and the number of these in which
  // none was found. 0: not measured.
  std::uint32_t compared = 0, changed = 0;
};

// What may be wrong with a loop closure.
enum class DoubtKind : std::uint8_t {
  kFewInliers = 1,     // few points agree on its transform
  kPoorSpread = 2,     // these lie in a small part of the picture
  kImprobable = 3,     // appearance alone would not have recognised the place
  kRunnerUp = 4,       // another place explains the picture nearly as well
  kChanged = 5,        // of what should be seen in both, much differs
  kContradiction = 6,  // other closures, or the robot's own motion, contradict it or once did
  kLonely = 7,         // no closure, or few, agree with it
  kTension = 8,        // refinement moved it away from what was measured
  kUnseen = 9          // going on from it, the robot did not see what the map shows there
};
// "few inliers", "another place fits", ...
const char* name_of(DoubtKind kind);

struct Doubt {
  DoubtKind kind = DoubtKind::kFewInliers;
  double weight = 0;    // its part of the suspicion, 0..1
  std::string message;  // in words, with the numbers
};

// How doubtful a loop closure is, as the daemon judges it. It decides nothing: it orders closures for those who look at
// them. What it says of the robot's motion is as the daemon found it when it judged the closure; Explanation::motion
// tells what holds now.
struct Suspicion {
  double value = 0;           // 0: nothing speaks against it; 1: it is wrong as far as the map can tell
  std::vector<Doubt> doubts;  // the heaviest first; without those of kinds that only a newer daemon knows
  // What else to know, in words: what the map does not know of the closure, or that an operator put it into force
  // and has neither withdrawn that nor removed it.
  std::string remark = {};
};

// A picture that the map keeps of a frame: of the rectified left camera, grey, possibly reduced.
struct FramePicture {
  std::string data;                     // JPEG; empty: there is none
  std::uint32_t width = 0, height = 0;  // of the picture, pixels
  double scale = 1;                     // pixels of the picture per pixel of the session's camera
  Status missing = {};                  // not ok: why there is no picture
};

// A point that a view and a frame of the map both show.
struct Correspondence {
  // In the view: pixels of its left picture as it was sent, or of the camera of features and of frames of the map.
  Vector2 in_view = Vector2::Zero();
  // In the frame: pixels of its session's rectified left camera. Measured there or, if `seen_in` is set, where the
  // landmark projects that this other frame beside it has measured.
  Vector2 in_frame = Vector2::Zero();
  bool inlier = false;  // it agrees with the verified transform
  // Pixels in the view between where it was measured and where the verified transform puts it; absent: without metres.
  std::optional<double> residual = {};
  std::optional<FrameId> seen_in = {};
};

// Consecutive frames of a session along which its robot was carried: loop closures in force contradict its odometry.
struct CarriedStretch {
  FrameId first, last;           // the older one first
  std::vector<EdgeId> closures;  // the closures that show it; at most 16
};

// Consecutive frames of a session between which nothing measured how its robot moved (Edge::unmeasured).
struct UnmeasuredStretch {
  FrameId first, last;  // the older one first
  std::uint32_t steps = 0;
  double distance_m = 0;  // a guess
};
// The unmeasured stretches of a route or path. If there are any, its transform is a guess.
struct Unmeasured {
  std::vector<UnmeasuredStretch> stretches = {};  // in order; at most 256
  std::uint32_t steps = 0;                        // of all stretches
  double distance_m = 0;                          // of all stretches: the part of the length that is a guess
};

// A relative pose as the robot itself or a closure's verification measured it, before anything was refined.
struct Measurement {
  SE3 T_ab;
  Matrix6 covariance = Matrix6::Identity();
};

struct Edge {
  EdgeId id;
  FrameId a, b;  // older, newer
  EdgeKind kind = EdgeKind::kOdometry;
  EdgeState state = EdgeState::kAccepted;
  Reason reason = Reason::OK;
  bool carries = false;  // an edge of the graph while accepted; false: a closure that only binds landmarks
  SE3 T_ab;
  Matrix6 covariance = Matrix6::Identity();
  std::uint32_t support = 0;                    // number of observations whose path uses it
  bool prior_active = false;                    // it has too little support, and so keeps the prior of its measurement
  MotionSource source = MotionSource::kVision;  // of the robot's motion
  // Neither a camera nor landmarks measured T_ab: it is a guess with this covariance (`source` tells of which kind), or
  // what the robot reports of a gap.
  bool unmeasured = false;
  double driven_s = 0, standing_s = 0;
  Verification verification = Verification::kNone;
  std::uint32_t inliers = 0;
  std::uint32_t bound = 0;  // number of observations and landmarks that it justifies
  double probability = 0, spread = 0;
  std::vector<EdgeId> consistent_with;
  std::vector<EdgeEvent> history;              // oldest first
  std::optional<Uniqueness> uniqueness = {};   // of a closure, if it is known
  std::vector<EdgeId> carried_by = {};         // of motion: closures which show that the robot was carried
  std::optional<CarriedStretch> carried = {};  // of a closure which shows that
  std::optional<Suspicion> suspicion = {};     // of a closure; absent: the daemon does not judge it
  std::int64_t time_us = 0;                    // when its newer end was taken, UTC; 0: the daemon does not tell
  std::optional<Measurement> measured = {};    // what T_ab was at first; absent: the daemon does not tell
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
  std::string thumbnail;                     // JPEG
  std::optional<FramePicture> picture = {};  // if it was asked for, and the daemon knows of pictures
};

// A picture or a stereo pair, as the bytes of JPEG or PNG files, and the camera that took it.
struct View {
  std::string left, right;
  // StereoCamera: the pictures are rectified; StereoCalibration: they are not; SessionNumber: they are raw pictures of
  // that session's camera. monostate: the camera is unknown, and is estimated if a pose in metres is asked for.
  std::variant<std::monostate, StereoCamera, StereoCalibration, SessionNumber> camera;
  bool rectified = false;  // with a session: the pictures are rectified already
  bool supposed = false;   // the camera is only assumed; the covariance allows for another one
  // With a session: it is not known which eye of the rig took the picture. The left one is assumed, and the covariance
  // allows for the right one.
  bool either_eye = false;
  // If set, the view is what this frame of the map saw, and all of the above is ignored.
  std::optional<FrameId> frame = {};
  // Not empty: features instead of pictures, of the rectified left picture of the camera, which must be named.
  std::vector<AppearanceFeature> features = {};
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
  bool near_prior = false;                           // found around the prior; probability and new_place are not set
  std::optional<double> estimated_focal_length;      // pixels of the picture; if its camera was unknown
  std::vector<Correspondence> correspondences = {};  // with `frame`, if asked for: the inliers first, at most 1024
};

struct MatchOptions {
  std::uint32_t max_places = 0;    // 0: 20
  std::uint32_t max_verified = 0;  // geometry is tried on this number of places; 0: 10, at most 20
  bool thumbnails = false;
  std::optional<FrameId> near = {};  // a frame supposed to be near; places around it are more likely
  bool correspondences = false;      // with the points that the view and each place have in common
};

struct PlaceMatch {
  FrameId frame;
  double probability = 0;  // by appearance
  Verification verification = Verification::kNone;
  std::uint32_t inliers = 0;
  double spread = 0;                // share of the picture that the inliers span, 0..1
  std::optional<SE3> T_frame_view;  // if it is verified in metres
  Matrix6 covariance = Matrix6::Identity();
  std::optional<double> estimated_focal_length;  // as in Localisation
  Status unverified;                             // not ok: why geometry has not confirmed it
  std::string thumbnail;                         // JPEG
  // If asked for, of a place on which geometry was tried: the inliers first, at most 1024.
  std::vector<Correspondence> correspondences = {};
};
struct PlaceMatches {
  std::vector<PlaceMatch> places;  // verified ones by number of inliers, then the others by probability
  double new_place = 1;
  Status nothing_verified;  // not ok: why no place is verified
};

struct Robot {
  std::string name;
};
// A frame, a label, the place of a view, or the newest frame of a robot.
using RouteEnd = std::variant<FrameId, std::string, View, Robot>;
enum class RouteBy : std::uint8_t { kDistance = 1, kTime = 2, kCertainty = 3 };

// The cost of an edge is the sum of its properties with these weights (relmap/v1/map.proto).
struct RouteWeights {
  double metre = 0, driven_second = 0, standing_second = 0, square_metre_of_variance = 0;
};
struct RouteFilter {
  std::vector<SessionNumber> sessions;  // only their frames may be passed; empty: all
  std::vector<FrameId> avoid_frames;
  std::vector<std::string> avoid_labels;
  std::uint32_t min_support = 0;
  bool long_loops = true;
  // Treat candidate or quarantined closures as edges.
  bool suppose_candidates = false, suppose_quarantined = false;
};

struct RouteRequest {
  RouteEnd from, to;
  RouteBy by = RouteBy::kDistance;
  bool count_standing = false;
  double max_cost = 0;                             // in the unit of the cost; 0: no limit
  std::vector<RouteEnd> or_from = {}, or_to = {};  // alternatives to `from` and `to`
  std::optional<RouteWeights> weights = {};        // instead of `by`
  RouteFilter filter = {};
  bool covariance = false;  // each step has T_start_this and its covariance
  // So many other routes, at most 5: each at most 1.5 times as dear as the cheapest, with at least a quarter of its
  // length apart from those before it.
  std::uint32_t alternatives = 0;
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
  // Set if RouteRequest::covariance is.
  SE3 T_start_this;
  Matrix6 covariance = Matrix6::Zero();  // of T_start_this Exp(xi)
};
struct Route {
  FrameId from, to;
  double cost = 0;  // the minimised cost
  double distance_m = 0, time_s = 0;
  std::uint32_t long_loops = 0;
  std::vector<CarriedStretch> carried;  // in the order of the route
  Unmeasured unmeasured = {};           // in the order of the route
  std::string frame_by_frame;           // why the daemon had to search frame by frame; empty: it searched by cells
  // The search also used closures that only bind landmarks: the daemon searched frame by frame, or the route is short
  // and its goal is among the 2,000 frames nearest to the start.
  bool bound_closures = false;
  bool no_way_by_edges = false;                    // no goal can be reached by edges alone, or none within max_cost
  std::optional<Localisation> from_view, to_view;  // of ends that are views
  std::vector<RouteStep> steps;
  double shared = 0;  // of an alternative: the share of its length that the routes before it use, too, 0..1
  // Other routes by cost, if they were asked for; there may be fewer. They have no alternatives themselves.
  std::vector<Route> alternatives = {};
};

struct TransformBetween {
  SE3 T_ab;
  Matrix6 covariance = Matrix6::Identity();
  std::uint32_t edges = 0;
  double distance_m = 0;
  bool compounded = false;                   // the covariance is compounded from those of single edges
  std::vector<CarriedStretch> carried = {};  // on the path, from a to b
  Unmeasured unmeasured = {};                // on the path, from a to b
};

struct LabelledFrames {
  std::string label;
  std::vector<FrameId> frames;
};

// A piece of a pose graph to be imported. Its frames have no pictures, and the axes of a camera (x right, y down,
// z forward).
struct GraphPiece {
  struct Frame {
    SE3 T_odom_frame;
    std::optional<Matrix6> step_covariance;  // of the motion from the previous frame; absent: not known
    std::int64_t time_us = 0;                // UTC
    std::int64_t driven_us = 0;
  };
  struct Loop {
    std::uint32_t query = 0, match = 0;  // indices; query is the later one
    SE3 T_match_query;
    Matrix6 covariance = Matrix6::Identity();
  };
  static constexpr std::size_t kMaxSent = 1000;  // frames, and loops

  SessionUuid session;
  std::string robot, name;
  std::uint32_t first = 0;  // index of frames[0]
  std::vector<Frame> frames;
  std::vector<Loop> loops;
};

// Frames around a frame, as a search along edges finds them.
struct Region {
  FrameId root;
  std::uint32_t max_edges = 0;  // 0: 30
  double max_metres = 0;        // along the path; 0: no limit
};

// What is around a frame in the graph.
struct Neighbourhood {
  struct Member {
    FrameId frame;
    SE3 T_root_frame;  // along the path by which the search found it
    double distance_m = 0;
    std::int64_t time_us = 0;
  };
  std::vector<Member> frames;  // in the order of discovery, the root first
  std::vector<Edge> edges;     // of the graph, between these frames
  bool cut = false;            // more frames are within the limits
};

enum class EdgeOrder : std::uint8_t {
  kId = 1,
  kSuspicion = 2,  // loop closures only, the most suspicious first
  kTime = 3        // loop closures only, the newest first
};

// What edges are listed. All conditions must hold.
struct EdgeFilter {
  std::vector<EdgeState> states;      // empty: all
  std::vector<EdgeKind> kinds;        // empty: all
  SessionNumber session = 0;          // with an end in this session; 0: any
  std::optional<FrameId> frame;       // of this frame
  SessionNumber other_session = 0;    // with `session`: between the two, or within one if they are the same; 0: any
  std::int64_t from_us = 0;           // of which the newer end was taken at this time or later, UTC; 0: any
  std::int64_t until_us = 0;          // ... before this time; 0: any
  double min_suspicion = 0;           // only loop closures at least as suspicious, 0..1; 0: any edges
  std::optional<Region> region = {};  // with an end there
  EdgeOrder order = EdgeOrder::kId;
  std::size_t limit = 0;  // at most so many, the first in this order; 0: all
};

// What an operator does to a loop closure.
enum class EdgeAction : std::uint8_t {
  kRemove,       // removes it, with all closures that agree with it
  kRemoveAlone,  // removes only this closure; those that agree with it stay
  kRestore,      // restores it, with those that were removed with it
  kAccept,       // puts it into force whatever its state; it is never outvoted
  kWithdraw      // withdraws kAccept: it returns to its state before
};
struct EditOptions {
  std::string note = {};  // for the journal
  bool dry_run = false;   // reports what the edit would change, and changes nothing
  // For a removal: EdgeEdit::shown of a dry run. WRONG_STATE if by now other closures would be removed than in the dry
  // run; 0: no such check.
  std::uint64_t shown = 0;
};

struct ClosureChange {
  EdgeId id;
  FrameId a, b;                            // older, newer
  std::optional<EdgeState> before, after;  // absent: it did not, or does not, exist
  Reason reason_before = Reason::OK, reason_after = Reason::OK;
  bool edge_before = false, edge_after = false;  // whether it is an edge of the graph
  // Numbers of observations and landmarks that it justifies while it is in force, and of frames that have them.
  std::uint32_t bound = 0, bound_frames = 0;
};
struct EditEffect {
  std::vector<ClosureChange> closures;
  std::vector<CarriedStretch> carried, not_carried;  // where the robot counts as carried from now on, or no longer
};
// The result of an edit or a proposal; for a dry run, the result that it would have.
struct EdgeEdit {
  Edge edge;  // afterwards
  EditEffect effect;
  bool done = false;        // it was not a dry run
  std::uint64_t shown = 0;  // for a dry run of a removal: identifies the closures to be removed, for EditOptions::shown
};

enum class ExportFormat : std::uint8_t { kTum = 1, kKitti = 2 };
// The next bytes of a session's file.
struct TrajectoryPiece {
  SessionNumber session = 0;
  std::string_view bytes;
  std::vector<Edge> doubtful;  // its edges that nothing measured, or along which the robot was carried
};

struct ExportedFrame {
  FrameId id;
  std::int64_t time_us = 0;  // UTC
  struct Landmark {
    Eigen::Vector3f point;        // in the frame's coordinates, metres
    std::uint32_t observers = 0;  // number of frames that determine it
  };
  std::vector<Landmark> landmarks;  // those in force, based in the frame, with measured depth
};

using ReasonCounts = std::map<Reason, std::uint64_t>;

// A session that is being received. Counts are since the daemon first heard of it. status.proto describes the fields.
struct RobotStatus {
  std::string uuid;
  SessionNumber session = 0;  // 0: not begun
  // Of a robot of which everything was refused: the one of its credentials, or else what its keyframes say. Empty: no
  // whole keyframe was received yet, and nobody proved to be it.
  std::string robot, name;
  double keyframes_per_s = 0, bytes_per_s = 0;  // over the last ten seconds
  double silent_s = 0;                          // since the last message from it
  std::optional<double> lag_s;      // from the time stamp of its newest durable keyframe until it was durable
  std::uint64_t next_sequence = 0;  // everything below is settled
  std::uint64_t seen = 0;           // 1 + the highest sequence of which anything was received
  std::uint32_t missing = 0, incomplete = 0, pending = 0;
  std::uint32_t queued_messages = 0;
  std::uint64_t dropped_messages = 0;
  std::uint32_t credits = 0;
  ReasonCounts refused, not_taken;
  Reason blocked = Reason::OK;
  double limit_hz = 0;
  std::vector<std::string> same_name;  // uuids of sessions that other robots of the same name send now
  bool silent = false;                 // nothing received for a minute, though its session has not ended
};

struct MemoryShare {
  std::string name;
  std::uint64_t used = 0, allowance = 0;
};

// A session whose calibration contradicts that of other sessions, where their pictures show the same places.
struct DoubtfulCamera {
  SessionNumber session = 0;
  std::string robot, name;
  std::vector<SessionNumber> against;
  std::uint64_t contradicted = 0;  // keyframes, of it and of those sessions, since the daemon started
  std::string message;             // from the last of these keyframes: the calibration that would fit
};

struct DaemonStatus {
  std::string version, boot_id, data_folder, lcm_url;
  std::string commit;     // of the source that the daemon was built from; empty: not known
  std::string log_level;  // trace, debug, info, warning or error
  // Of who asks: the name in the credentials, and reader, robot or operator.
  std::string caller_name, caller_role;
  MapIdentity map;  // not known() if the daemon does not report it
  std::uint64_t pid = 0;
  std::int64_t uptime_us = 0;
  bool deterministic = false;
  // Not ok: why the daemon accepts nothing, nothing over LCM, fewer connections than was configured, an access list
  // that is out of date, or soon nobody over TLS.
  Status storage, lcm, connections, access, certificate;
  // Parts of the daemon, and what is wrong with each: storage, worker, intake. Empty if the daemon does not tell.
  std::vector<std::pair<std::string, Status>> components;
  // Steps of the system's clock by more than a second since the start, and the last of them.
  std::uint64_t clock_steps = 0;
  double clock_step_s = 0;
  std::uint64_t connections_open = 0, connections_refused = 0,
                connections_displaced = 0;  // the last two: since the start

  std::uint32_t sessions = 0, labels = 0;
  std::uint64_t frames = 0, gaps = 0, refused = 0, places = 0, places_left_out = 0;
  ReasonCounts refused_by_reason;
  std::vector<DoubtfulCamera> doubtful_cameras;
  // The cells by which routes are found in milliseconds, and why there are none (empty: there are).
  std::uint64_t route_chunks = 0, route_chunks_changed = 0, route_cells_outdated = 0;
  std::uint32_t route_weights = 0;
  std::string routes_missing_because;
  std::uint64_t closures_candidate = 0, closures_accepted = 0, closures_quarantined = 0, closures_removed = 0;

  std::uint64_t durable_sequence = 0, applied_sequence = 0;
  std::uint64_t queued = 0, lookup_lag = 0, pending_frames = 0;
  double lookup_lag_s = 0;
  double relaxation_p50_us = 0, relaxation_p99_us = 0, relaxation_max_us = 0;
  double active_frames_mean = 0;
  std::uint64_t solves = 0, numerical_failures = 0;

  std::uint64_t memory_budget = 0, memory_used = 0, resident_bytes = 0, resident_max_bytes = 0;
  std::vector<MemoryShare> memory_shares;
  std::uint32_t vocabulary_words = 0;
  std::string vocabulary_source;

  std::uint64_t ingest_keyframes = 0, ingest_repeats = 0, ingest_parts_corrupt = 0, robots = 0;
  ReasonCounts not_taken;
  std::uint64_t map_version = 0;  // grows with every change of the map since the daemon started
};

}  // namespace relmap::client
