#include "client/skeleton_relaxation.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace relmap::client {
namespace {

// Of a step along which the robot was carried: it counts next to nothing beside what closures measured.
constexpr double kCarriedMetres = 3e4, kCarriedRadians = 3;
constexpr double kLeast = 1e-10;  // of a variance: a step of none would be infinitely stiff

Matrix6 covariance_of(double translation_trace, double rotation_trace) {
  Vector6 diagonal;
  diagonal << Vector3::Constant(std::max(translation_trace / 3, kLeast)),
      Vector3::Constant(std::max(rotation_trace / 3, kLeast));
  return diagonal.asDiagonal();
}

// Sets of points that edges connect (union-find).
class Joined {
 public:
  explicit Joined(std::size_t points) : parent_(points) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  void join(std::size_t a, std::size_t b) { parent_[root(a)] = root(b); }
  bool are(std::size_t a, std::size_t b) { return root(a) == root(b); }

 private:
  std::size_t root(std::size_t point) {
    while (parent_[point] != point) point = parent_[point] = parent_[parent_[point]];
    return point;
  }
  std::vector<std::size_t> parent_;
};

struct Graph {
  std::vector<FrameId> points;  // ascending
  std::vector<RelaxationEdge> edges;

  std::optional<std::size_t> find(FrameId frame) const {
    const auto at = std::lower_bound(points.begin(), points.end(), frame);
    if (at == points.end() || *at != frame) return std::nullopt;
    return static_cast<std::size_t>(at - points.begin());
  }
};

Graph graph_of(const Skeleton& skeleton) {
  Graph graph;
  for (const Skeleton::Chain& chain : skeleton.chains)
    for (const Skeleton::Point& point : chain.points) graph.points.push_back(point.frame);
  std::sort(graph.points.begin(), graph.points.end());
  graph.points.erase(std::unique(graph.points.begin(), graph.points.end()), graph.points.end());
  Joined joined(graph.points.size());
  std::vector<RelaxationEdge> doubtful;
  const auto add = [&](const RelaxationEdge& edge) {
    joined.join(*graph.find(edge.a), *graph.find(edge.b));
    graph.edges.push_back(edge);
  };
  for (const Skeleton::Chain& chain : skeleton.chains)
    for (std::size_t i = 1; i < chain.points.size(); ++i) {
      const Skeleton::Point& point = chain.points[i];
      RelaxationEdge edge{chain.points[i - 1].frame, point.frame, point.T_before_this,
                          covariance_of(point.translation_variance, point.rotation_variance),
                          RelaxationEdgeKind::kOdometry};
      if (point.carried) edge.covariance = covariance_of(kCarriedMetres, kCarriedRadians);
      if (point.carried || point.unmeasured)
        doubtful.push_back(edge);
      else
        add(edge);
    }
  for (const Skeleton::Closure& closure : skeleton.closures) {
    if (closure.state != EdgeState::kAccepted || !closure.carries) continue;
    if (!graph.find(closure.a) || !graph.find(closure.id.frame)) continue;  // of a skeleton that is not read whole
    add({closure.a, closure.id.frame, closure.T_ab,
         covariance_of(closure.translation_variance, closure.rotation_variance), RelaxationEdgeKind::kLoop});
  }
  for (const RelaxationEdge& edge : doubtful)
    if (!joined.are(*graph.find(edge.a), *graph.find(edge.b))) graph.edges.push_back(edge);
  return graph;
}

}  // namespace

const SE3* RelaxedSkeleton::Part::find(FrameId frame) const {
  const auto at = std::lower_bound(places.begin(), places.end(), frame,
                                   [](const Place& place, FrameId id) { return place.frame < id; });
  return at == places.end() || at->frame != frame ? nullptr : &at->T_root_frame;
}

Result<RelaxedSkeleton> relax_skeleton(const Skeleton& skeleton, const SkeletonLayout& layout) {
  const Graph graph = graph_of(skeleton);
  if (graph.points.empty()) return {Reason::EMPTY_MAP, "the skeleton has no points"};
  if (layout.root && !graph.find(*layout.root))
    return {Reason::NO_SUCH_FRAME, "frame " + layout.root->to_string() + " is no point of the skeleton"};
  const auto relaxed = relax(graph.points, graph.edges, layout.relaxation);
  if (!relaxed.ok()) return relaxed.status();
  RelaxedSkeleton out;
  out.converged = relaxed->converged;
  out.parts.resize(static_cast<std::size_t>(relaxed->components));
  for (const RelaxedPose& pose : relaxed->poses) {
    RelaxedSkeleton::Part& part = out.parts[static_cast<std::size_t>(pose.component)];
    if (!part.root.valid() || pose.frame == layout.root) part.root = pose.frame;
    part.places.push_back({pose.frame, pose.T_component_frame});
  }
  for (RelaxedSkeleton::Part& part : out.parts) {
    const SE3 T_root_component = part.find(part.root)->inverse();
    for (auto& place : part.places) place.T_root_frame = (T_root_component * place.T_root_frame).normalized();
  }
  std::stable_sort(out.parts.begin(), out.parts.end(), [&](const auto& x, const auto& y) {
    if (layout.root && (x.root == layout.root) != (y.root == layout.root)) return x.root == layout.root;
    return x.places.size() > y.places.size();
  });
  return out;
}

}  // namespace relmap::client
