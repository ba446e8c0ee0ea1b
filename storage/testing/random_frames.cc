#include "storage/testing/random_frames.h"

#include <limits>
#include <optional>
#include <utility>

namespace relmap::storage {
namespace {

template <typename Enum>
Enum pick(RandomFrames& random, Enum first, Enum last) {
  const auto low = static_cast<std::uint32_t>(first), high = static_cast<std::uint32_t>(last);
  return static_cast<Enum>(low + random.below(high - low + 1));
}

Reason some_reason(RandomFrames& random) {
  static constexpr Reason kReasons[] = {Reason::OK, Reason::MOTION, Reason::CONSISTENT, Reason::DROPPED_BY_ROBOT};
  return kReasons[random.below(4)];
}

}  // namespace

double RandomFrames::real() {
  switch (below(40)) {
    case 0:
      return -0.0;
    case 1:
      return std::numeric_limits<double>::quiet_NaN();
    case 2:
      return std::numeric_limits<double>::denorm_min();
    default:
      return std::normal_distribution<double>(0, 10)(rng_);
  }
}

FrameId RandomFrames::frame_id() { return {1 + below(5), below(2000)}; }
EdgeId RandomFrames::edge_id() { return {frame_id(), below(4)}; }
LandmarkId RandomFrames::landmark_id() { return {frame_id(), below(100)}; }

SE3 RandomFrames::transform() {
  Vector6 xi;
  for (int i = 0; i < 6; ++i) xi[i] = std::normal_distribution<double>(0, 0.5)(rng_);
  return SE3::exp(xi);
}

Matrix6 RandomFrames::matrix() {
  Matrix6 m;
  for (int i = 0; i < 36; ++i) m(i) = real();
  return m;
}

std::string RandomFrames::text(std::uint32_t max_size) {
  std::string text(below(max_size + 1), ' ');
  for (char& c : text) c = static_cast<char>(below(256));
  return text;
}

Bytes RandomFrames::bytes(std::uint32_t max_size) {
  const std::string t = text(max_size);
  return {t.begin(), t.end()};
}

// No extensions half of the time.
Extensions RandomFrames::extensions() {
  Extensions all;
  if (below(2) == 0) return all;
  for (std::uint32_t n = below(3), tag = 1000; n > 0; --n) all.push_back({tag += 1 + below(1u << 30), bytes(40)});
  return all;
}

Submission RandomFrames::submission() {
  Submission s;
  if (below(2) == 1) s.time_us = static_cast<std::int64_t>(rng_());
  if (below(2) == 1) s.author = below(2) == 1 ? "ann" : "x" + text(kMaxAuthorBytes - 1);
  return s;
}

Uniqueness RandomFrames::uniqueness() {
  Uniqueness u;
  u.known = below(2) == 1;
  if (!u.known) return u;
  u.runner_up = frame_id();
  u.runner_up_inliers = static_cast<std::uint16_t>(below(65536));
  u.runner_up_probability = static_cast<float>(real());
  u.alike = static_cast<std::uint16_t>(below(65536));
  u.differs = static_cast<float>(real());
  u.compared = static_cast<std::uint16_t>(below(49));
  u.changed = static_cast<std::uint16_t>(below(u.compared + 1u));
  return u;
}

std::shared_ptr<const WayAround> RandomFrames::way_around() {
  if (below(3) != 0) return nullptr;
  return std::make_shared<const WayAround>(WayAround{{1 + below(9), below(1000)}, transform(), matrix()});
}

Edge RandomFrames::edge(FrameId frame, std::uint32_t ordinal) {
  Edge e;
  e.id = {frame, ordinal};
  e.a = frame_id();
  e.b = frame;
  e.kind = pick(*this, EdgeKind::kOdometry, EdgeKind::kPrior);
  e.state = pick(*this, EdgeState::kCandidate, EdgeState::kRemoved);
  e.reason = some_reason(*this);
  e.source = pick(*this, MotionSource::kStart, MotionSource::kUnsensed);
  e.carries = below(2) == 1;
  e.prior_active = below(2) == 1;
  e.support = below(1000);
  e.T_ab = transform();
  e.covariance = matrix();
  e.prior_T_ab = transform();
  e.prior_covariance = matrix();
  if (below(2) == 1)
    for (std::int8_t& part : e.correlation_with_previous) part = static_cast<std::int8_t>(below(256));
  e.driven_s = static_cast<float>(real());
  e.standing_s = static_cast<float>(real());
  e.verification = pick(*this, Verification::kNone, Verification::kCompounded);
  e.inliers = static_cast<std::uint16_t>(below(65536));
  e.bound = static_cast<std::uint16_t>(below(65536));
  e.probability = static_cast<float>(real());
  e.spread = static_cast<float>(real());
  for (std::uint32_t n = below(4); n > 0; --n) e.bound_frames.push_back(frame_id());
  for (std::uint32_t n = below(4); n > 0; --n) e.consistent_with.push_back(edge_id());
  for (std::uint32_t n = below(3), sequence = 0; n > 0; --n)
    e.history.push_back({sequence += 1 + below(1000), pick(*this, EdgeState::kCandidate, EdgeState::kRemoved),
                         some_reason(*this), edge_id(), below(2) == 1 ? "a note" : "", submission().time_us,
                         submission().author});
  e.uniqueness = uniqueness();
  e.around = way_around();
  for (std::uint32_t n = below(4), index = 0; n > 0; --n) e.unseen.push_back(index += 1 + below(100));
  if (below(3) == 0)
    e.tests = {static_cast<std::uint16_t>(below(9)), pick(*this, MotionSays::kNothing, MotionSays::kContradicts),
               static_cast<float>(std::abs(real()))};
  if (below(3) == 0) {
    const std::uint32_t first = below(1000);
    e.carried = {1 + below(9), first, first + 1 + below(100)};
  }
  for (std::uint32_t n = below(3); n > 0; --n) e.carried_by.push_back(edge_id());
  e.unknown = extensions();
  return e;
}

Landmark RandomFrames::landmark() {
  Landmark l;
  l.abr = {real(), real(), real()};
  l.track = {below(1000), below(100)};
  l.depth_prior = below(2) == 1;
  for (std::uint32_t n = below(3); n > 0; --n)
    l.claims.push_back({landmark_id(), below(8) == 0 ? kFromDeletedSession : edge_id()});
  for (std::uint32_t n = below(5); n > 0; --n) l.observers.push_back(frame_id());
  return l;
}

FrameHot RandomFrames::hot(FrameId id) {
  FrameHot f;
  f.present = true;
  f.time_us = static_cast<std::int64_t>(rng_());
  f.journal_sequence = rng_();
  f.payload_crc = static_cast<std::uint32_t>(rng_());
  f.T_odom_frame = transform();
  f.mean_error = static_cast<float>(real());
  f.error_terms = below(1000);
  f.appearance_count = 0;  // as in the cold part that it is stored with
  f.next_loop_ordinal = static_cast<std::uint16_t>(below(65536));
  const std::uint32_t edges = below(4);
  for (std::uint32_t i = 0; i < edges; ++i) f.edges.push_back(edge(id, i));
  for (std::uint32_t n = below(3); n > 0; --n) f.incoming.push_back(edge_id());
  for (std::uint32_t n = below(20); n > 0; --n) f.landmarks.push_back(landmark());
  for (std::uint32_t n = below(3); n > 0; --n) f.unreached.push_back({below(20), frame_id()});
  for (std::uint32_t n = below(3); n > 0; --n) f.labels.push_back(text(20));
  f.unknown = extensions();
  return f;
}

FrameWarm RandomFrames::warm() {
  FrameWarm f;
  for (std::uint32_t n = below(60); n > 0; --n) {
    Observation o;
    o.landmark = landmark_id();
    if (below(4) == 0) o.origin = below(8) == 0 ? kFromDeletedSession : edge_id();
    o.u_left = static_cast<float>(real());
    o.v = static_cast<float>(real());
    o.u_right = static_cast<float>(real());
    o.level = static_cast<std::uint8_t>(below(8));
    o.aligned = below(2) == 0;
    f.observations.push_back(o);
  }
  return f;
}

FrameCold RandomFrames::cold() {
  FrameCold f;
  for (std::uint32_t n = below(12); n > 0; --n) {
    AppearanceFeature a;
    a.u = static_cast<float>(real());
    a.v = static_cast<float>(real());
    a.disparity = static_cast<float>(real());
    a.scale = static_cast<float>(real());
    a.angle = static_cast<float>(real());
    a.track = static_cast<std::int16_t>(below(100)) - 1;
    for (auto& byte : a.descriptor) byte = static_cast<std::uint8_t>(below(256));
    f.appearance.push_back(a);
    f.words.push_back(below(10000));
  }
  f.picture = bytes(200);
  return f;
}

SessionHeader RandomFrames::header() {
  SessionHeader h;
  for (auto& byte : h.uuid.bytes) byte = static_cast<std::uint8_t>(below(256));
  h.robot = text(20);
  h.name = text(20);
  h.camera = {real(), real(), real(), real(), static_cast<int>(below(2000)), static_cast<int>(below(2000))};
  h.oneway = below(2) == 1;
  h.unknown = extensions();
  return h;
}

Skipped RandomFrames::skipped() { return {below(100), below(100), below(100), below(2) == 1, some_reason(*this)}; }

Session RandomFrames::session(SessionNumber number) {
  Session s;
  s.number = number;
  s.header = header();
  s.display_name = text(30);
  s.first = below(100);
  s.last = below(10000);
  s.frames = below(10000);
  s.next_sequence = below(10000);
  s.refused = below(100);
  s.given_up = below(1000);
  s.first_time_us = static_cast<std::int64_t>(rng_());
  s.last_time_us = static_cast<std::int64_t>(rng_());
  s.state = pick(*this, SessionState::kOpen, SessionState::kDeleting);
  if (is_frozen(s) && below(2) == 1) s.before_frozen = SessionState::kEnded;
  s.unknown = extensions();
  if (is_going(s)) s.deleted_by = submission().author;
  return s;
}

std::vector<ProposedBinding> RandomFrames::bindings() {
  std::vector<ProposedBinding> all;
  for (std::uint32_t n = below(30); n > 0; --n)
    all.push_back({landmark_id(), static_cast<std::int32_t>(below(100)) - 1, static_cast<float>(real()),
                   static_cast<float>(real()), static_cast<float>(real()), static_cast<std::uint8_t>(below(8)),
                   below(2) == 0});
  return all;
}

JournalRecord RandomFrames::record() {
  JournalRecord record = unsubmitted();
  if (Submission* submitted = storage::submission(record)) *submitted = submission();
  return record;
}

JournalRecord RandomFrames::unsubmitted() {
  switch (below(12)) {
    case 0:
      return SessionRecord{1 + below(9), text(30), header()};
    case 1:
      return KeyframeRecord{1 + below(9), below(1u << 31), bytes(2000)};
    case 2: {
      const std::uint32_t from = below(100);
      return GapRecord{1 + below(9), from, from + below(10), some_reason(*this)};
    }
    case 3:
      return RefusalRecord{1 + below(9), below(100), below(1u << 31), some_reason(*this)};
    case 4: {
      ClosureProposalRecord x;
      x.query = frame_id();
      x.match = frame_id();
      x.T_match_query = transform();
      x.covariance = matrix();
      x.verification = pick(*this, Verification::kNone, Verification::kCompounded);
      x.inliers = static_cast<std::uint16_t>(below(65536));
      x.probability = static_cast<float>(real());
      x.spread = static_cast<float>(real());
      x.bindings = bindings();
      x.uniqueness = uniqueness();
      x.around = way_around();
      if (below(3) == 0) x.unseen = edge_id();
      x.unknown = extensions();
      return x;
    }
    case 5:
      return BindingRecord{frame_id(), edge_id(), bindings()};
    case 6:
      return SetEdgeStateRecord{edge_id(),     pick(*this, EdgeState::kCandidate, EdgeState::kRemoved),
                                text(100),     below(2) == 1,
                                below(2) == 1, below(3),
                                extensions()};
    case 7:
      return SetLabelRecord{frame_id(), text(100), below(2) == 1, extensions()};
    case 8:
      return SetSessionStateRecord{below(100), pick(*this, SessionState::kOpen, SessionState::kDeleting), extensions()};
    case 9:
      return RemoveChunkRecord{below(100), below(1000), extensions()};
    case 10:
      return UnseenRecord{frame_id(), edge_id(), extensions()};
    default:
      return IdleWorkRecord{rng_()};
  }
}

Event RandomFrames::event(EventPosition at) {
  Event event{at, submission(), text(20), {}};
  const auto edge_event = [this] {
    const Edge e = edge(frame_id(), below(5));
    return ClosureEvent{e.id,           e.a,       e.kind,        e.state, e.reason, e.carries, e.T_ab,
                        e.verification, e.inliers, e.probability, e.spread};
  };
  switch (below(9)) {
    case 0: {
      const Session s = session(1 + below(9));
      event.content = SessionEvent{s.number, s.header.uuid, s.header.robot, s.display_name, s.state};
      break;
    }
    case 1:
      event.content = FrameAddedEvent{frame_id(), static_cast<std::int64_t>(rng_()),
                                      below(2) == 1 ? std::optional<SE3>(transform()) : std::nullopt,
                                      static_cast<MotionSource>(below(kMotionSources))};
      break;
    case 2:
      event.content = SkippedEvent{1 + below(9), skipped()};
      break;
    case 3:
      event.content = FramesRemovedEvent{1 + below(9), below(1000)};
      break;
    case 4:
      event.content = SessionDeletedEvent{1 + below(9), session(1).header.uuid};
      break;
    case 5:
      event.content = edge_event();
      break;
    case 6:
      event.content = ClosureRemovedEvent{edge_id()};
      break;
    case 7: {
      LabelsEvent labels{frame_id(), {}};
      for (std::uint32_t n = below(4); n > 0; --n) labels.labels.push_back(text(30));
      event.content = std::move(labels);
      break;
    }
    default: {
      FramesMovedEvent moved;
      for (std::uint32_t n = below(5), first = 0; n > 0; --n) {
        first += below(100);
        moved.ranges.push_back({1 + below(3), first, first + below(50)});
      }
      event.content = std::move(moved);
    }
  }
  return event;
}

}  // namespace relmap::storage
