#include "tools/relmap-admin/drill_questions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "proto/base/number_text.h"
#include "storage/map/map.h"

namespace relmap::admin {

namespace {

constexpr std::size_t kMemory = std::size_t{128} << 20;
constexpr std::uint32_t kRouteFrames = 200;  // of the robot's motion, to the frame that a route leads to
constexpr std::size_t kEnoughFeatures = 40;  // for a frame to be recognised by them
constexpr std::size_t kComparedSessions = 1000;
constexpr std::int64_t kBeside = 5;  // frames from one to another of the same place
constexpr double kNear_m = 10;       // what is seen from a place is seen from so far, too
constexpr double kSamePose = 1e-6;   // metres and radians: answers are rounded to doubles of another form

client::Session session_of(const storage::Session& stored) {
  client::Session session;
  session.number = stored.number;
  session.state = static_cast<client::SessionState>(stored.state);
  session.uuid = stored.header.uuid.to_string();
  session.robot = stored.header.robot;
  session.name = stored.display_name;
  session.first = stored.first;
  session.last = stored.last;
  session.frames = stored.frames;
  return session;
}

// A session that has frames to be asked about, and how many of them there are before it.
struct Share {
  storage::Session session;
  std::uint64_t before = 0;
};

class Reader {
 public:
  explicit Reader(const storage::MapView& view) : view_(view) {
    view_.visit_sessions(0, [&](const storage::Session& session) {
      if (session.frames > 0 && !storage::is_going(session)) {
        shares_.push_back({session, frames_});
        frames_ += session.frames;
      }
      return true;
    });
  }

  // Distinct frames, chosen at random; all if there are not more than `count`.
  std::set<FrameId> sample(std::size_t count, std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    std::set<FrameId> chosen;
    const bool all = count >= frames_;
    for (std::uint64_t i = 0; i < (all ? frames_ : count * 4) && chosen.size() < count; ++i) {
      const std::uint64_t number = all ? i : std::uniform_int_distribution<std::uint64_t>(0, frames_ - 1)(random);
      const Share& share = *std::prev(std::upper_bound(shares_.begin(), shares_.end(), number,
                                                       [](std::uint64_t n, const Share& s) { return n < s.before; }));
      // Gaps make indices sparse: the first frame from there on that exists.
      std::uint64_t index = share.session.first + (number - share.before);
      while (index <= share.session.last && !view_.hot({share.session.number, static_cast<std::uint32_t>(index)}))
        ++index;
      if (index <= share.session.last) chosen.insert({share.session.number, static_cast<std::uint32_t>(index)});
    }
    return chosen;
  }

  KnownFrame frame(FrameId id) const {
    const auto hot = view_.hot(id);
    KnownFrame known{id,
                     hot->time_us,
                     hot->labels,
                     hot->edges.size(),
                     hot->landmarks.size(),
                     view_.warm(id)->observations.size(),
                     hot->appearance_count,
                     {},
                     {},
                     {}};
    for (const storage::Edge& edge : hot->edges)
      if (edge.in_graph()) known.neighbours.push_back({edge.a, edge.b, edge.T_ab});
    const StereoCamera camera = view_.session(id.session)->header.camera;
    if (hot->appearance_count >= kEnoughFeatures) known.features = view_.cold(id)->appearance;
    if (camera.baseline > 0) follow(id, known);
    return known;
  }

 private:
  // Follows the robot's motion from a frame.
  void follow(FrameId id, KnownFrame& known) const {
    auto hot = view_.hot(id);
    for (std::uint32_t step = 0; step < kRouteFrames; ++step) {
      const auto next = storage::next_in_session(id, *hot);
      if (!next) return;
      hot = view_.hot(*next);
      const storage::Edge* motion = storage::motion_to(*hot);
      if (!motion || motion->a != id || !motion->in_graph()) return;
      known.metres_there += motion->T_ab.t.norm();
      known.reachable = id = *next;
    }
  }

  const storage::MapView& view_;
  std::vector<Share> shares_;
  std::uint64_t frames_ = 0;
};

Status differs(const std::string& question, const std::string& answer, const std::string& known) {
  return {Reason::INTERNAL, question + ": the daemon says " + answer + ", the files say " + known};
}

// Collects the first difference.
class Comparison {
 public:
  explicit Comparison(std::string about) : about_(std::move(about)) {}

  template <typename Value>
  Comparison& equal(const char* what, const Value& answer, const Value& known) {
    if (status_.ok() && answer != known) status_ = differs(about_ + ", " + what, text(answer), text(known));
    return *this;
  }
  Comparison& count(const char* what, std::uint64_t answer, std::uint64_t known) { return equal(what, answer, known); }
  const Status& status() const { return status_; }

 private:
  static std::string text(const std::string& value) { return "'" + value + "'"; }
  template <typename Number>
  static std::string text(Number value) {
    return std::to_string(value);
  }

  const std::string about_;
  Status status_;
};

bool same_pose(const SE3& l, const SE3& r) {
  return (l.t - r.t).norm() <= kSamePose * (1 + r.t.norm()) && (l.R - r.R).norm() <= kSamePose;
}

Status ask_status(client::Client& daemon, const KnownMap& known) {
  const auto status = daemon.status();
  if (!status.ok()) return status.status();
  return Comparison("status")
      .equal("identity", status->map.uuid.to_string(), known.identity.uuid.to_string())
      .count("epoch", status->map.epoch, known.identity.epoch)
      .count("sessions", status->sessions, known.sessions)
      .count("frames", status->frames, known.frames)
      .count("gaps", status->gaps, known.gaps)
      .count("labels", status->labels, known.labels)
      .count("accepted closures", status->closures_accepted, known.closures_accepted)
      .count("candidates", status->closures_candidate, known.closures_candidate)
      .count("quarantined closures", status->closures_quarantined, known.closures_quarantined)
      .count("removed closures", status->closures_removed, known.closures_removed)
      .status();
}

Status ask_sessions(client::Client& daemon, const KnownMap& known, QuestionCounts& counts) {
  const auto sessions = daemon.sessions();
  if (!sessions.ok()) return sessions.status();
  std::map<SessionNumber, const client::Session*> answers;
  for (const client::Session& session : *sessions) answers[session.number] = &session;
  for (const client::Session& wanted : known.first_sessions) {
    const auto found = answers.find(wanted.number);
    const std::string about = "session " + std::to_string(wanted.number);
    if (found == answers.end()) return differs(about, "that there is none", "'" + wanted.name + "'");
    const client::Session& answer = *found->second;
    ++counts.sessions;
    const Status same =
        Comparison(about)
            .equal("uuid", answer.uuid, wanted.uuid)
            .equal("robot", answer.robot, wanted.robot)
            .equal("name", answer.name, wanted.name)
            .count("frames", answer.frames, wanted.frames)
            .count("first frame", answer.first, wanted.first)
            .count("last frame", answer.last, wanted.last)
            .equal("state", std::string(client::name_of(answer.state)), std::string(client::name_of(wanted.state)))
            .status();
    if (!same.ok()) return same;
  }
  return {};
}

Status ask_frame(client::Client& daemon, const KnownFrame& known, QuestionCounts& counts) {
  const auto frame = daemon.frame(known.id);
  if (!frame.ok()) return frame.status();
  ++counts.frames;
  std::string labels, known_labels;
  for (const std::string& label : frame->labels) labels += label + "; ";
  for (const std::string& label : known.labels) known_labels += label + "; ";
  return Comparison("frame " + known.id.to_string())
      .equal("time", frame->time_us, known.time_us)
      .equal("labels", labels, known_labels)
      .count("edges", frame->edges.size(), known.edges)
      .count("landmarks", frame->landmarks, known.landmarks)
      .count("observations", frame->observations, known.observations)
      .count("features", frame->appearance, known.appearance)
      .status();
}

Status ask_transforms(client::Client& daemon, const KnownFrame& known, QuestionCounts& counts) {
  for (const KnownEdge& edge : known.neighbours) {
    const auto found = daemon.transform_between(edge.a, edge.b);
    if (!found.ok()) return found.status();
    ++counts.transforms;
    // Two edges may join the same frames: the path takes one of them.
    const bool same =
        found->edges == 1 && std::any_of(known.neighbours.begin(), known.neighbours.end(), [&](const KnownEdge& one) {
          return one.a == edge.a && one.b == edge.b && same_pose(found->T_ab, one.T_ab);
        });
    if (!same)
      return differs("transform from " + edge.a.to_string() + " to " + edge.b.to_string(),
                     fixed(found->T_ab.t.norm(), 6) + " m over " + counted_text(found->edges, "edge"),
                     fixed(edge.T_ab.t.norm(), 6) + " m over 1 edge");
  }
  return {};
}

Status ask_route(client::Client& daemon, const KnownFrame& known, QuestionCounts& counts) {
  if (known.reachable.session == 0) return {};
  const auto route = daemon.find_route({.from = known.id, .to = known.reachable});
  if (!route.ok()) return route.status();
  ++counts.routes;
  const std::string about = "route from " + known.id.to_string() + " to " + known.reachable.to_string();
  if (route->steps.empty() || route->steps.front().frame != known.id || route->steps.back().frame != known.reachable)
    return differs(about, "another way", "these ends");
  constexpr double kExact = 1e-4;  // costs of cells are sums of floats
  if (route->distance_m > known.metres_there * (1 + kExact) + kExact)
    return differs(about, fixed(route->distance_m, 3) + " m", fixed(known.metres_there, 3) + " m as the robot drove");
  return {};
}

Status ask_place(client::Client& daemon, const KnownFrame& known, QuestionCounts& counts) {
  if (known.features.empty()) return {};
  client::View view;
  view.features = known.features;
  view.camera = known.id.session;
  const auto matches = daemon.match_image(view);
  if (!matches.ok()) return matches.status();
  ++counts.places;
  // A place is named by one of its frames: that of the question, one beside it, or one of another session that the
  // map's closures join to it.
  const bool recognised = std::any_of(matches->places.begin(), matches->places.end(), [&](const auto& place) {
    const auto apart = std::int64_t{place.frame.index} - std::int64_t{known.id.index};
    if (place.frame.session == known.id.session) return std::abs(apart) <= kBeside;
    const auto between = daemon.transform_between(known.id, place.frame);
    return between.ok() && between->T_ab.t.norm() <= kNear_m;
  });
  if (recognised) return {};
  return differs("place of what frame " + known.id.to_string() + " saw",
                 matches->places.empty() ? "nothing" : "frame " + matches->places.front().frame.to_string(),
                 "that frame");
}

}  // namespace

Result<KnownMap> read_known_map(std::shared_ptr<storage::Engine> engine, std::size_t frames, std::uint64_t seed) try {
  KnownMap known;
  known.applied_sequence = engine->applied_sequence();
  const auto map = storage::Map::open(std::move(engine), 0, std::make_shared<storage::Budget>(kMemory)).or_throw();
  const auto view = map->view();
  const storage::MapFacts& facts = view->state();
  known.identity = facts.identity;
  known.sessions = view->session_counts().all;
  known.labels = view->labels("").size();
  known.frames = facts.keyframes;
  known.gaps = facts.gaps;
  known.closures_accepted = facts.closures_accepted;
  known.closures_candidate = facts.closures_candidate;
  known.closures_quarantined = facts.closures_quarantined;
  known.closures_removed = facts.closures_removed;
  view->visit_sessions(0, [&](const storage::Session& session) {
    if (!storage::is_deleted(session)) known.first_sessions.push_back(session_of(session));
    return known.first_sessions.size() < kComparedSessions;
  });
  const Reader reader(*view);
  for (const FrameId id : reader.sample(frames, seed)) known.sample.push_back(reader.frame(id));
  return known;
} catch (const StatusError& error) {
  return error.status();
}

Status ask_questions(client::Client& daemon, const KnownMap& known,
                     const std::function<Status(std::uint64_t done, std::uint64_t total)>& progress,
                     QuestionCounts& counts) {
  if (Status same = ask_status(daemon, known); !same.ok()) return same;
  if (Status same = ask_sessions(daemon, known, counts); !same.ok()) return same;
  std::uint64_t done = 0;
  for (const KnownFrame& frame : known.sample) {
    if (Status going = progress(done++, known.sample.size()); !going.ok()) return going;
    for (const auto ask : {ask_frame, ask_transforms, ask_route, ask_place})
      if (Status same = ask(daemon, frame, counts); !same.ok()) return same;
  }
  return {};
}

}  // namespace relmap::admin
