#include "client/springs.h"

#include <algorithm>
#include <unordered_set>

namespace relmap::client {
namespace {

RelaxationEdgeKind relaxation_kind(EdgeKind kind) {
  switch (kind) {
    case EdgeKind::kLoop:
      return RelaxationEdgeKind::kLoop;
    case EdgeKind::kPrior:
      return RelaxationEdgeKind::kPrior;
    case EdgeKind::kOdometry:
      break;
  }
  return RelaxationEdgeKind::kOdometry;
}

}  // namespace

// A step without any variance would be infinitely stiff.
Matrix6 isotropic_covariance(double translation_trace, double rotation_trace) {
  constexpr double kLeast = 1e-10;
  Vector6 diagonal;
  diagonal << Vector3::Constant(std::max(translation_trace / 3, kLeast)),
      Vector3::Constant(std::max(rotation_trace / 3, kLeast));
  return diagonal.asDiagonal();
}

const Matrix6& carried_covariance() {
  static const Matrix6 covariance = Vector6(1e4, 1e4, 1e4, 1, 1, 1).asDiagonal();
  return covariance;
}

FrameId MeasuredSets::root(FrameId frame) {
  parent_.try_emplace(frame, frame);
  while (parent_.at(frame) != frame) frame = parent_[frame] = parent_.at(parent_.at(frame));
  return frame;
}

MeasuredSets choose_pulling(std::vector<Spring>& springs) {
  MeasuredSets measured;
  for (const Spring& spring : springs)
    if (!spring.doubtful) measured.connect(spring.relaxed.a, spring.relaxed.b);
  for (Spring& spring : springs) spring.pulls = !spring.doubtful || !measured.join(spring.relaxed.a, spring.relaxed.b);
  return measured;
}

std::vector<Spring> springs_of(const std::vector<Edge>& edges) {
  std::vector<Spring> springs;
  for (const Edge& edge : edges) {
    const bool holds_nothing = edge.unmeasured && edge.source == MotionSource::kUnsensed;
    if (!in_graph(edge) || holds_nothing) continue;
    Spring& spring = springs.emplace_back();
    spring.edge = edge.id;
    spring.kind = edge.kind;
    spring.doubtful = is_doubtful(edge);
    spring.relaxed = {edge.a, edge.b, edge.T_ab, edge.carried_by.empty() ? edge.covariance : carried_covariance(),
                      relaxation_kind(edge.kind)};
  }
  choose_pulling(springs);
  return springs;
}

Spring spring_of(const Skeleton::Closure& closure) {
  Spring spring;
  spring.edge = closure.id;
  spring.kind = EdgeKind::kLoop;
  spring.relaxed = {closure.a, closure.id.frame, closure.T_ab,
                    isotropic_covariance(closure.translation_variance, closure.rotation_variance),
                    RelaxationEdgeKind::kLoop};
  return spring;
}

std::vector<Spring> springs_of(const Skeleton& skeleton) {
  std::vector<Spring> springs;
  std::unordered_set<FrameId> points;
  for (const Skeleton::Chain& chain : skeleton.chains)
    for (std::size_t i = 0; i < chain.points.size(); ++i) {
      const Skeleton::Point& point = chain.points[i];
      points.insert(point.frame);
      if (i == 0) continue;
      Spring& spring = springs.emplace_back();
      if (point.frames == 1) spring.edge = {point.frame, 0};
      spring.kind = point.unmeasured ? EdgeKind::kPrior : EdgeKind::kOdometry;
      spring.doubtful = point.unmeasured || point.carried;
      spring.relaxed = {chain.points[i - 1].frame, point.frame, point.T_before_this,
                        point.carried ? carried_covariance()
                                      : isotropic_covariance(point.translation_variance, point.rotation_variance),
                        RelaxationEdgeKind::kOdometry};
    }
  for (const Skeleton::Closure& closure : skeleton.closures) {
    if (closure.state != EdgeState::kAccepted || !closure.carries) continue;
    if (!points.contains(closure.a) || !points.contains(closure.id.frame)) continue;
    springs.push_back(spring_of(closure));
  }
  choose_pulling(springs);
  return springs;
}

}  // namespace relmap::client
