#include "tests/support/skeleton_city.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <unordered_map>

#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

constexpr double kBlock = 100;                           // metres between two streets
constexpr double kCorner = 4;                            // metres over which a corner is rounded
constexpr double kStepSigma = 0.005, kTurnSigma = 2e-4;  // of a step: m, rad
constexpr double kLoopSigma = 0.02, kLoopTurnSigma = 1e-3;
constexpr std::uint32_t kLandmarks = 8, kObservers = 4, kFramesPerCommit = 4000;
constexpr double kCandidates = 0.03;        // share of the closures that are not in force
constexpr std::uint32_t kAgreeWithin = 40;  // frames: consecutive closures to one session agree
constexpr std::int64_t kBegin_us = 1'700'000'000'000'000;

// Corners that a robot passes, a block apart.
std::vector<Vector2> corners(const SkeletonCity& city, SessionNumber session) {
  std::mt19937_64 random(city.seed * 1'000'003 + session);
  const auto below = [&](std::uint32_t n) { return static_cast<int>(random() % n); };
  const int streets = static_cast<int>(city.streets);
  int x = below(city.streets), y = below(city.streets), direction = below(4);
  constexpr int kX[] = {1, 0, -1, 0}, kY[] = {0, 1, 0, -1};
  std::vector<Vector2> all;
  const auto blocks = static_cast<std::size_t>(city.frames_per_session / kBlock) + 3;
  while (all.size() < blocks) {
    all.emplace_back(kBlock * x, kBlock * y);
    if (below(2) == 0) direction = (direction + (below(2) == 0 ? 1 : 3)) % 4;
    while (x + kX[direction] < 0 || x + kX[direction] >= streets || y + kY[direction] < 0 ||
           y + kY[direction] >= streets)
      direction = (direction + 1) % 4;
    x += kX[direction];
    y += kY[direction];
  }
  return all;
}

Vector2 along(const std::vector<Vector2>& corners, double metres) {
  const double blocks = std::max(0.0, metres) / kBlock;
  const auto at = std::min(static_cast<std::size_t>(blocks), corners.size() - 2);
  return corners[at] + (blocks - static_cast<double>(at)) * (corners[at + 1] - corners[at]);
}

SE3 noisy(const SE3& T, double sigma, double turn_sigma, std::mt19937_64& random) {
  std::normal_distribution<double> unit;
  Vector6 xi;
  for (int i = 0; i < 6; ++i) xi[i] = unit(random) * (i < 3 ? sigma : turn_sigma);
  return (T * SE3::exp(xi)).normalized();
}

Matrix6 covariance(double sigma, double turn_sigma) {
  Vector6 diagonal;
  diagonal << Vector3::Constant(sigma * sigma), Vector3::Constant(turn_sigma * turn_sigma);
  return diagonal.asDiagonal();
}

// A metre of a street in one direction.
std::uint64_t place_of(const SE3& pose) {
  const auto x = static_cast<std::uint64_t>(std::lround(pose.t.x()) + 1000);
  const auto z = static_cast<std::uint64_t>(std::lround(pose.t.z()) + 1000);
  const Vector3 forward = pose.R.col(2);
  const auto quarter =
      static_cast<std::uint64_t>(std::lround(std::atan2(forward.x(), forward.z()) / (std::numbers::pi / 2)) + 4);
  return (x << 32 | z) * 8 + quarter % 4;
}

class Builder {
 public:
  Builder(const SkeletonCity& city, storage::Map& map) : city_(city), map_(map) {}

  // Adds the frames of a session that the map does not have yet.
  void add_session(SessionNumber number) {
    const std::vector<SE3> way = true_way(city_, number);
    std::mt19937_64 random(city_.seed * 7'000'003 + number);
    std::uniform_real_distribution<double> share(0, 1);
    const auto known = map_.session(number);
    if (!known) begin(number);
    std::optional<storage::Edge> last_closure;
    for (std::uint32_t i = 0; i < way.size(); ++i) {
      const FrameId id{number, i};
      const auto [before, fresh] = last_.try_emplace(place_of(way[i]), Seen{id, way[i]});
      storage::FrameHot hot = frame(id);
      if (i > 0) hot.edges.push_back(step(id, noisy(way[i - 1].inverse() * way[i], kStepSigma, kTurnSigma, random)));
      if (!fresh && before->second.frame.session != number && share(random) < city_.closures)
        hot.edges.push_back(closure(id, before->second, way[i], share(random) < kCandidates, random));
      before->second = {id, way[i]};
      if (known && i < known->next_sequence) continue;
      if (hot.edges.size() > 1 || (i == 0 && !hot.edges.empty())) agree_with_last(hot.edges.back(), last_closure);
      add(id, std::move(hot));
    }
    if (!known || known->next_sequence < way.size()) commit_if(true);
  }

 private:
  struct Seen {
    FrameId frame;
    SE3 pose;
  };

  // Closures that follow one another along two ways agree.
  void agree_with_last(storage::Edge& edge, std::optional<storage::Edge>& last) {
    if (last && last->a.session == edge.a.session && edge.b.index - last->b.index <= kAgreeWithin) {
      edge.consistent_with.push_back(last->id);
      if (map_.hot(last->b))
        for (storage::Edge& before : map_.edit_hot(last->b).edges)
          if (before.id == last->id) before.consistent_with.push_back(edge.id);
    }
    last = edge;
  }
  void begin(SessionNumber number) {
    storage::Session session;
    session.number = number;
    for (std::size_t i = 0; i < 4; ++i) session.header.uuid.bytes[i] = static_cast<std::uint8_t>(number >> (8 * i));
    session.header.uuid.bytes[15] = 1;
    session.header.robot = "robot-" + std::to_string(number % 50);
    session.header.name = session.display_name = "tour-" + std::to_string(number);
    session.header.camera = {500, 320, 240, 0.25, 640, 480};
    session.first_time_us = session.last_time_us = time_of({number, 0});
    session.state = storage::SessionState::kEnded;
    map_.add_session(session);
  }
  std::int64_t time_of(FrameId id) const {
    return kBegin_us + (std::int64_t{id.session} * city_.frames_per_session + id.index) * 200'000;
  }
  storage::FrameHot frame(FrameId id) const {
    storage::FrameHot hot;
    hot.present = true;
    hot.time_us = time_of(id);
    hot.journal_sequence = std::uint64_t{id.session} * city_.frames_per_session + id.index;
    for (std::uint32_t slot = 0; slot < kLandmarks; ++slot) {
      storage::Landmark landmark;
      landmark.track = {id.index, slot};
      for (std::uint32_t i = 0; i < kObservers; ++i) landmark.observers.push_back({id.session, id.index + i});
      hot.landmarks.push_back(landmark);
    }
    return hot;
  }
  static storage::Edge step(FrameId id, const SE3& T) {
    storage::Edge edge;
    edge.id = {id, 0};
    edge.a = {id.session, id.index - 1};
    edge.b = id;
    edge.T_ab = edge.prior_T_ab = T;
    edge.covariance = edge.prior_covariance = covariance(kStepSigma, kTurnSigma);
    edge.support = 100;
    edge.driven_s = 0.2F;
    return edge;
  }
  static storage::Edge closure(FrameId id, const Seen& before, const SE3& pose, bool candidate,
                               std::mt19937_64& random) {
    storage::Edge edge;
    edge.id = {id, 1};
    edge.a = before.frame;
    edge.b = id;
    edge.kind = storage::EdgeKind::kLoop;
    edge.state = candidate ? storage::EdgeState::kCandidate : storage::EdgeState::kAccepted;
    edge.reason = candidate ? Reason::LONE : Reason::CONSISTENT;
    edge.verification = storage::Verification::kStereo;
    edge.T_ab = edge.prior_T_ab = noisy(before.pose.inverse() * pose, kLoopSigma, kLoopTurnSigma, random);
    edge.covariance = edge.prior_covariance = covariance(kLoopSigma, kLoopTurnSigma);
    edge.inliers = 60;
    edge.bound = 20;
    edge.support = 40;
    edge.probability = 0.98F;
    edge.spread = 0.4F;
    return edge;
  }
  void add(FrameId id, storage::FrameHot hot) {
    for (const storage::Edge& edge : hot.edges) {
      auto& incoming = map_.edit_hot(edge.a).incoming;
      incoming.insert(std::upper_bound(incoming.begin(), incoming.end(), edge.id), edge.id);
    }
    hot.next_loop_ordinal = static_cast<std::uint16_t>(hot.edges.empty() ? 1 : hot.edges.back().id.ordinal + 1);
    storage::MapState& state = map_.state();
    for (const storage::Edge& edge : hot.edges)
      if (edge.kind == storage::EdgeKind::kLoop)
        ++(edge.state == storage::EdgeState::kAccepted ? state.closures_accepted : state.closures_candidate);
    map_.add_frame(id, std::move(hot), {}, {});
    storage::Session& session = map_.edit_session(id.session);
    session.last = id.index;
    session.next_sequence = id.index + 1;
    session.last_time_us = time_of(id);
    ++session.frames;
    ++state.keyframes;
    commit_if(++uncommitted_ >= kFramesPerCommit);
  }
  void commit_if(bool due) {
    if (!due && !map_.commit_is_due()) return;
    throw_if(map_.commit());
    uncommitted_ = 0;
  }

  const SkeletonCity& city_;
  storage::Map& map_;
  std::unordered_map<std::uint64_t, Seen> last_;  // by place: who was there last
  std::uint32_t uncommitted_ = 0;
};

}  // namespace

std::vector<SE3> true_way(const SkeletonCity& city, SessionNumber session) {
  const std::vector<Vector2> way = corners(city, session);
  const std::uint32_t before = (session - 1) * city.frames_per_session;
  const std::uint32_t frames = std::min(city.frames_per_session, city.frames - std::min(city.frames, before));
  std::vector<SE3> poses(frames);
  for (std::uint32_t i = 0; i < frames; ++i) {
    const double s = kCorner + i;
    const Vector2 behind = along(way, s - kCorner), ahead = along(way, s + kCorner);
    const Vector2 at = (behind + 2 * along(way, s) + ahead) / 4, forward = (ahead - behind).normalized();
    poses[i].t = {at.x(), 0, at.y()};
    poses[i].R = so3_exp({0, std::atan2(forward.x(), forward.y()), 0});
  }
  return poses;
}

void build_city(const SkeletonCity& city, storage::Map& map) {
  Builder builder(city, map);
  const SessionNumber sessions = (city.frames + city.frames_per_session - 1) / city.frames_per_session;
  for (SessionNumber number = 1; number <= sessions; ++number) builder.add_session(number);
}

void build_city_folder(const SkeletonCity& city, const std::string& folder) {
  const auto map = make_stored_map(folder);
  build_city(city, *map);
}

}  // namespace relmap::testing
