// One frame of the relative map, in the three parts in which it is stored (docs/storage-format.md):
//   hot   edges, landmark positions, closures, aliases; rewritten by every bundle adjustment that touches it
//   warm  observations; written once when the frame is applied, and when a closure binds more
//   cold  descriptors, words, picture; never rewritten
// Every fact is stored once. What is marked "derived" is a back reference or count that follows from facts stored
// elsewhere: `verify` checks it, `repair` rebuilds it.
//
// A published part is immutable; the map worker edits copies (storage/map/map.h).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/reason.h"
#include "proto/geometry/geometry.h"
#include "proto/keyframe/extensions.h"
#include "proto/keyframe/keyframe.h"
#include "storage/graph/frame_range.h"

namespace relmap::storage {

inline constexpr std::uint32_t kFramesPerChunk = 64;
inline std::uint32_t chunk_of(FrameId id) { return id.index / kFramesPerChunk; }

enum class EdgeKind : std::uint8_t { kOdometry = 1, kLoop = 2, kPrior = 3 };  // prior: over a gap or unseen motion
enum class EdgeState : std::uint8_t { kCandidate = 1, kAccepted = 2, kQuarantined = 3, kRemoved = 4 };

// How a loop closure was confirmed.
enum class Verification : std::uint8_t {
  kNone = 0,
  kStereo = 1,
  kPnP = 2,
  kEpipolar = 3,
  kImported = 4,
  kCompounded = 5,  // replaces a path through a session that has been deleted (server/map/deletion.h)
};
// Whether the closure is metric, so that it may become an edge. An imported one was verified elsewhere, if at all.
inline bool is_metric(Verification v) { return v != Verification::kNone && v != Verification::kEpipolar; }

inline constexpr std::size_t kMaxAuthorBytes = 128;  // of a name

// A change of the state of a loop closure.
struct EdgeEvent {
  std::uint64_t journal_sequence = 0;  // of the record that caused it
  EdgeState state = EdgeState::kCandidate;
  Reason reason = Reason::LONE;
  EdgeId cause;      // the closure whose proposal or edit caused it: itself, or one that agrees or conflicts with it
  std::string note;  // the operator's
  // When the record was submitted, UTC, and by whom; 0 and empty: not known. They say how the map came about and not
  // what it is, so they are no part of its hash.
  std::int64_t time_us = 0;
  std::string author = {};

  bool operator==(const EdgeEvent&) const = default;
};

// How far a recognised place stands out from all others, as the lookup found it. Unknown for an imported closure.
struct Uniqueness {
  bool known = false;  // false: nothing below is set, and it counts neither for nor against the closure
  FrameId runner_up;   // the best of the places elsewhere that geometry confirms; invalid: none
  std::uint16_t runner_up_inliers = 0;  // at the runner-up
  float runner_up_probability = 0;      // of the runner-up, by appearance
  std::uint16_t alike = 0;              // number of places elsewhere that geometry confirms
  // The share (0..1) of what both views should show in which they show different things; negative: not measured.
  float differs = -1;
  // Measured by landmarks (server/place/changes.h): the number of cells of the picture in which landmarks should be
  // found again by their appearance, and in how many of these none is found. 0 and 0: not measured.
  std::uint16_t compared = 0, changed = 0;

  bool operator==(const Uniqueness&) const = default;
};

// What the robot's own motion said of a closure when it was judged (server/map/consistency.h).
enum class MotionSays : std::uint8_t { kNothing = 0, kAgrees = 1, kContradicts = 2 };

// What the judgements of closures found out about one of them, beyond those that agree with it: by its own, and by
// those of later closures. It is told to people and decides nothing.
struct ClosureTests {
  // Number of closures that contradicted it and with which no third one in force reconciled it, each counted when the
  // later of the two was judged.
  std::uint16_t opposing = 0;
  MotionSays motion = MotionSays::kNothing;
  // Of kAgrees and kContradicts: how well the motion tells where the closure's ends lie, one standard deviation,
  // metres.
  float motion_sigma = 0;

  bool operator==(const ClosureTests&) const = default;
};

// What the map says, by a closure and a way that does not lead through a stop, of the motion of the session that made
// the closure. The odometry between the two frames leads through a stop: the robot may have been carried there
// (server/map/way_around.h). It is what the map said when the closure was proposed, and is not changed later.
struct WayAround {
  FrameId from;                          // a frame before the stop, of the session of the closure's newer end
  SE3 T;                                 // T_from_b, b the closure's newer end
  Matrix6 covariance = Matrix6::Zero();  // of T Exp(xi), with the drift along the way

  bool operator==(const WayAround& other) const {
    return from == other.from && T.R == other.T.R && T.t == other.T.t && covariance == other.covariance;
  }
};

// An edge of the graph, or a loop closure that only binds landmarks (`carries == false`). It is stored with the newer
// of its two frames.
struct Edge {
  EdgeId id;
  FrameId a;  // the older frame, by the order in which the map took them in
  FrameId b;  // the newer; b == id.frame
  EdgeKind kind = EdgeKind::kOdometry;
  EdgeState state = EdgeState::kAccepted;
  Reason reason = Reason::MOTION;  // why it is in this state
  MotionSource source = MotionSource::kVision;
  bool carries = true;        // it is part of the graph while accepted (docs/method.md, 2)
  bool prior_active = false;  // derived: support < kMinSupport, or kind == kPrior
  std::uint32_t support = 0;  // derived: observations whose path uses it

  SE3 T_ab;                              // the estimate
  Matrix6 covariance = Matrix6::Zero();  // marginal covariance of xi in T_ab Exp(xi)
  // Correlation of its xi (rows) with that of the odometry edge that ends in `a` (columns), in 127ths, stored by
  // columns (storage/graph/precision.h); zero where they are independent or the correlation is unknown.
  std::array<std::int8_t, 36> correlation_with_previous{};
  SE3 prior_T_ab;  // what the robot itself, or the closure's verification, measured
  Matrix6 prior_covariance = Matrix6::Identity();

  float driven_s = 0;    // odometry edge: seconds driven since the frame before; loop edge: docs/method.md, 8
  float standing_s = 0;  // seconds standing, likewise

  // Evidence of a loop closure.
  Verification verification = Verification::kNone;
  std::uint16_t inliers = 0;
  std::uint16_t bound = 0;              // derived: observations and aliases that it justifies
  float probability = 0;                // of the place, by appearance
  float spread = 0;                     // share of the picture that the inliers span, 0..1
  std::vector<FrameId> bound_frames;    // frames in which it binds (claims or observations), b among them; ascending
  std::vector<EdgeId> consistent_with;  // proposals that agree with it pairwise; kept for later evidence
  std::vector<EdgeEvent> history;       // oldest first: the first event and the latest ones, kMaxEvents at most
  Uniqueness uniqueness;
  // Null: the closure is with the session's own past, or there is no stop or no such way.
  std::shared_ptr<const WayAround> around;

  // Indices, ascending, of frames that its newer end's session took after it, from where landmarks around its older end
  // should have been seen, and none was (server/map/unseen.h). kMaxUnseen at most.
  std::vector<std::uint32_t> unseen;

  ClosureTests tests;

  // Of a closure that agrees with others and not with the odometry of its newer end's session: it says that the robot
  // was carried somewhere between the frames `first` and `last`. Session 0: it says nothing of the kind.
  FrameRange carried;
  // Derived, ascending, of an odometry edge: the accepted closures in whose `carried` it lies. While there are any, the
  // transform from `first` to `last` is what they measured and not what the odometry says.
  std::vector<EdgeId> carried_by;

  Extensions unknown;  // from a later version, kept unchanged

  bool in_graph() const { return state == EdgeState::kAccepted && carries; }
  FrameId other(FrameId end) const { return end == a ? b : a; }
};

// Visits the odometry edges along which `closure` says that the robot was carried; none unless it is accepted.
template <typename Visit>
void for_each_carried_step(const Edge& closure, Visit visit) {
  if (closure.carried.session == 0 || closure.state != EdgeState::kAccepted) return;
  for (std::uint32_t index = closure.carried.first; index < closure.carried.last; ++index)
    visit(EdgeId{{closure.carried.session, index + 1}, 0});
}

inline constexpr std::size_t kMaxUnseen = 64;     // kept with an edge
inline constexpr std::size_t kMaxEvents = 16;     // kept in the history of an edge
inline constexpr std::uint32_t kMinSupport = 20;  // observations; below it an edge keeps its prior (docs/method.md, 2)

// Whether the motion along the edge is a guess of the robot that no camera saw: dead reckoning, a gap, a robot that
// started anew.
inline bool is_guessed(const Edge& edge) {
  return edge.kind == EdgeKind::kPrior || edge.source == MotionSource::kUnsensed;
}
// Whether the motion is a guess and too few landmarks have been seen from both sides since to support the edge.
inline bool is_unmeasured(const Edge& edge) { return is_guessed(edge) && edge.support < kMinSupport; }
// Whether the robot stood still for most of the time of an odometry edge.
inline bool stood(const Edge& motion) { return motion.standing_s > motion.driven_s; }

// The closure of claims and observations whose own closure was deleted with its session (server/map/deletion.h). It is
// always in force.
inline constexpr ClosureId kFromDeletedSession{{}, 1};

// A closure's claim that landmark `self`, with which the claim is stored, is the same point as `target`. With an
// invalid target it claims that `self` is not needed, since older landmarks around it have been found in the same
// picture. Of a landmark's claims the first one whose closure is accepted holds (storage/graph/binding.h). The target's
// base was taken in before the base of `self`, so claims never form a cycle.
struct AliasClaim {
  LandmarkId target;
  ClosureId closure;
};

// A point, stored in its base frame by inverse depth: p_base = (a, b, 1) / rho.
struct Landmark {
  Vector3 abr = {0, 0, 0.1};  // (a, b, rho); rho >= 1e-5 per metre
  TrackId track;              // of the base frame's session
  bool depth_prior = false;   // derived: seen in mono only, with < 1 degree of parallax (docs/method.md, 3)
  std::vector<AliasClaim> claims;
  // Derived: the first frames that have an observation which resolves to this landmark, and a path from its base; in
  // the order in which the map took them in (storage/graph/observers.h).
  std::vector<FrameId> observers;

  Vector3 point() const { return Vector3(abr.x(), abr.y(), 1) / abr.z(); }
};

// A frame that sees the landmark in `slot`, but whose observation has no effect: the frame has no path from the
// landmark's base, or the landmark is not needed.
struct Unreached {
  std::uint32_t slot = 0;
  FrameId observer;

  auto operator<=>(const Unreached&) const = default;
};

struct FrameHot {
  bool present = false;  // false: the sequence has no frame (gap, refusal); nothing else is set
  std::int64_t time_us = 0;
  std::uint64_t journal_sequence = 0;  // of its record; gives the order in which the map took its frames in
  std::uint32_t payload_crc = 0;       // CRC32C of the keyframe as received: tells a repeat from a conflict
  SE3 T_odom_frame;                    // the robot's own odometry, as received
  float mean_error = -1;  // mean reprojection error in px after the last accepted solve with it active; -1: none
  std::uint32_t error_terms = 0;       // number of observations in mean_error
  std::uint32_t appearance_count = 0;  // features in its cold part
  std::uint16_t next_loop_ordinal = 1;
  std::vector<Edge> edges;           // stored here: the odometry edge first, then closures, ascending by ordinal
  std::vector<EdgeId> incoming;      // derived, ascending: edges stored with newer frames that end here
  std::vector<Landmark> landmarks;   // by slot
  std::vector<Unreached> unreached;  // derived, ascending: frames that see these landmarks without effect
  std::vector<std::string> labels;
  Extensions unknown;  // from a later version, in its keyframe or added since; kept unchanged

  Edge* edge(EdgeId id) {
    for (Edge& e : edges)
      if (e.id == id) return &e;
    return nullptr;
  }
  const Edge* edge(EdgeId id) const { return const_cast<FrameHot*>(this)->edge(id); }
};

// The odometry edge that leads to the frame of `hot`; nullptr if there is none.
inline const Edge* motion_to(const FrameHot& hot) {
  return !hot.edges.empty() && hot.edges.front().id.ordinal == 0 ? &hot.edges.front() : nullptr;
}

// The order in which the map took its frames in. It alone decides which of two frames is older. One owner numbers all
// frames. Where a map comes to have several owners, each numbers its own journal, and the owner of the frame decides
// between equal numbers (docs/storage-format.md, Owners).
struct TakenIn {
  std::uint64_t sequence = 0;

  auto operator<=>(const TakenIn&) const = default;
};
inline TakenIn taken_in(const FrameHot& frame) { return {frame.journal_sequence}; }

// What a frame measured of a landmark.
struct Observation {
  LandmarkId landmark;  // as stored: that of its track, or the old landmark if bound without a track; resolve() gives
                        // the landmark in force
  ClosureId origin;     // ClosureId(): tracking; otherwise the closure that justifies it
  float u_left = 0, v = 0, u_right = 0;  // pixels; u_right is NaN in mono
  std::uint8_t level = 0;
  bool aligned = false;  // found by aligning the picture with an earlier view of the landmark: as exact as tracking

  bool is_tracked() const { return origin == ClosureId(); }
  StereoPixel pixel() const { return {u_left, v, u_right}; }
};

struct FrameWarm {
  std::vector<Observation> observations;  // tracked ones in the order of Keyframe::tracks, then bound ones
};

// The word of each feature, under the map's vocabulary, which storage does not know. Thread-safe.
using WordFunction = std::function<std::vector<std::uint32_t>(std::span<const AppearanceFeature>)>;

struct FrameCold {
  std::vector<AppearanceFeature> appearance;
  std::vector<std::uint32_t> words;  // of `appearance`, one each, under the map's vocabulary
  Bytes picture;                     // Keyframe::picture
};

// Approximate bytes in memory, for the budget.
std::size_t memory_bytes(const FrameHot& frame);
std::size_t memory_bytes(const FrameWarm& frame);
std::size_t memory_bytes(const FrameCold& frame);

// Sequences of a session that are skipped: they have no frame.
struct Skipped {
  std::uint32_t from = 0, to = 0;  // inclusive
  std::uint32_t crc = 0;           // of a refused keyframe; 0 for a gap
  bool refused = false;            // false: a gap
  Reason reason = Reason::OK;

  bool operator==(const Skipped&) const = default;
};

// Numbers on disk; they never change.
enum class SessionState : std::uint8_t {
  kOpen,
  kEnded,     // its robot said that it is complete; another keyframe opens it again
  kFrozen,    // takes no keyframes, and nothing in it moves
  kDeleting,  // takes no keyframes; its frames are being removed
};

// What storage knows of a session beside its frames.
struct Session {
  SessionNumber number = 0;
  SessionHeader header;
  std::string display_name;  // header.name, or name#2 ... when the name was taken by another uuid
  std::uint32_t first = 0;   // lowest and
  std::uint32_t last = 0;    // highest index present
  std::uint32_t frames = 0;
  std::uint32_t next_sequence = 0;  // every sequence below it is applied, refused or a gap
  std::uint64_t refused = 0;        // skipped sequences whose keyframes were refused
  std::uint64_t given_up = 0;       // skipped sequences in gaps; Graph::visit_skipped() lists both
  std::int64_t first_time_us = 0;
  std::int64_t last_time_us = 0;
  SessionState state = SessionState::kOpen;
  SessionState before_frozen = SessionState::kOpen;  // of a frozen session: what it was, and is again when it is thawed
  Extensions unknown;                                // from a later version, kept unchanged
  // While it is being deleted: who wanted that (Submission::author); empty: not known. No part of hashes.
  std::string deleted_by = {};
};

// Approximate bytes in memory, for the budget.
std::size_t memory_bytes(const Session& session);

// Whether it is being deleted, or has been: it takes no keyframes.
inline bool is_going(const Session& session) { return session.state == SessionState::kDeleting; }

// Whether it is frozen: it takes no keyframes, and its frames do not move.
inline bool is_frozen(const Session& session) { return session.state == SessionState::kFrozen; }

// Whether nothing is left of it but its uuid, which is never used again.
inline bool is_deleted(const Session& session) { return is_going(session) && session.frames == 0; }

// Drops what a deleted session does not need, so that the record that keeps its uuid from being used again is small.
void shrink_deleted(Session& session);

// Whether a frame that the session once had has been removed with it; the newest frames are removed first.
inline bool is_removed(const Session& session, FrameId id) {
  return is_going(session) && (session.frames == 0 || id.index > session.last);
}

// All sequences below this are frames or skipped. Of a session that is being deleted, what was at or above it has been
// removed.
inline std::uint64_t end_of(const Session& session) {
  if (!is_going(session)) return session.next_sequence;
  return session.frames > 0 ? std::uint64_t{session.last} + 1 : 0;
}

}  // namespace relmap::storage
