#include "client/skeleton_relaxation.h"

#include <algorithm>

namespace relmap::client {
namespace {

std::vector<FrameId> points_of(const Skeleton& skeleton) {
  std::vector<FrameId> points;
  for (const Skeleton::Chain& chain : skeleton.chains)
    for (const Skeleton::Point& point : chain.points) points.push_back(point.frame);
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

}  // namespace

const SE3* RelaxedSkeleton::Part::find(FrameId frame) const {
  const auto at = std::lower_bound(places.begin(), places.end(), frame,
                                   [](const Place& place, FrameId id) { return place.frame < id; });
  return at == places.end() || at->frame != frame ? nullptr : &at->T_root_frame;
}

Result<RelaxedSkeleton> relax_skeleton(const Skeleton& skeleton, const SkeletonLayout& layout) {
  const std::vector<FrameId> points = points_of(skeleton);
  if (points.empty()) return {Reason::EMPTY_MAP, "the skeleton has no points"};
  if (layout.root && !std::binary_search(points.begin(), points.end(), *layout.root))
    return {Reason::NO_SUCH_FRAME, "frame " + layout.root->to_string() + " is no point of the skeleton"};
  RelaxedSkeleton out;
  out.springs = springs_of(skeleton);
  std::vector<RelaxationEdge> edges;
  for (const Spring& spring : out.springs)
    if (spring.pulls) edges.push_back(spring.relaxed);
  const auto relaxed = relax(points, edges, layout.relaxation);
  if (!relaxed.ok()) return relaxed.status();
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
